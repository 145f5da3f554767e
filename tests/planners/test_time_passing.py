"""The table of what legs give, against exact integrals and against small moves."""

import numpy as np
import pytest

from mavplan.inflight import received_on_legs
from mavplan.mission.motion import rest_to_rest
from mavplan.planners.time_passing import PassTable
from mavplan.radio import Channel
from mavplan.scenario import D2D, Radio

CHANNELS = {
    "free space": Channel(Radio(), 100.0, D2D()),
    "town": Channel(Radio(path_loss_exponent=3.5, ref_gain_db=-30.0), 60.0, D2D()),
    "off its place": Channel(Radio(), 100.0, D2D(), position_error_m=5.0),
}


def field(channel, seed=0):
    """A path of fifteen legs, some short, and sixty users round it."""
    rng = np.random.default_rng(seed)
    extent = 6 * channel.radius_m
    path = rng.uniform(0, extent, (16, 2))
    path[4:7] = path[3] + rng.normal(size=(3, 2)) * 0.1 * channel.radius_m
    return path, rng.uniform(0, extent, (60, 2))


@pytest.mark.parametrize("channel", CHANNELS.values(), ids=CHANNELS)
def test_the_table_gives_what_the_integral_gives(channel):
    path, users = field(channel)
    length = np.linalg.norm(np.diff(path, axis=0), axis=1)
    bits = received_on_legs(users, path[:-1], path[1:], rest_to_rest(length, 10.0), channel)
    best_bit_s = channel.radio.bandwidth_hz * channel.air_rate(np.zeros(1))[0]
    found = PassTable.of(channel).metres(path[:-1], path[1:], users).sum(axis=0) / 10.0
    assert found == pytest.approx(bits / best_bit_s, abs=1e-3)
    assert found.max() > 20


@pytest.mark.parametrize("channel", CHANNELS.values(), ids=CHANNELS)
def test_the_slopes_are_those_of_small_moves(channel):
    table = PassTable.of(channel)
    path, users = field(channel, seed=3)
    away = np.linalg.norm(path[:, None] - users, axis=2)
    best = channel.air_rate(np.zeros(1))[0]
    share = np.where(channel.reaches(away), channel.air_rate(away) / best, 0.0)
    by_start, by_end = table.slopes(path[:-1], path[1:], users, share)
    step = 0.02
    for axis in range(2):
        move = np.zeros(2)
        move[axis] = step
        for slope, ends in (
            (by_start, (path[:-1] + move, path[1:], path[:-1] - move, path[1:])),
            (by_end, (path[:-1], path[1:] + move, path[:-1], path[1:] - move)),
        ):
            numeric = (table.metres(*ends[:2], users) - table.metres(*ends[2:], users)) / (2 * step)
            off = np.abs(numeric - slope[:, axis])
            # Where a disc is only just touched the slope is infinite, and cut.
            assert np.quantile(off, 0.97) < 0.01
