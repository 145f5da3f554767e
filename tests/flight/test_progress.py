"""How far a mission has been flown, told by MISSION_CURRENT alone."""

import pytest

from mavplan.flight.progress import MissionProgress
from mavplan.flight.route import make_route
from mavplan.flight.telemetry import MissionCurrent
from mavplan.mission.autopilots import AUTOPILOTS
from tests.link.harness import make_mission


def flown(firmware, holds_s, hold_s=300.0):
    """Progress over stops that were each held so long, with ten seconds of flight before each."""
    route = make_route(make_mission(firmware, len(holds_s), hold_s), AUTOPILOTS[firmware])
    progress, now = MissionProgress(route), 0.0
    for seq in range(route.first_seq, route.last_seq + 1):
        progress.on_current(MissionCurrent(seq, None, 3, None, now), now)
        stop = route.stop_at(seq)
        now += 10.0 if stop is None or seq < stop.hold_seq else holds_s[stop.number - 1]
    return progress


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
@pytest.mark.parametrize("cut", [1, 2, 5])
def test_only_the_stop_whose_hold_was_cut_is_named(firmware, cut):
    """Though so much is missing that no stretch around it was long enough either."""
    kept = [310.0] * 5
    progress = flown(firmware, [5.0 if number == cut else held for number, held in enumerate(kept, start=1)])
    route = progress.route
    assert [stop.number for stop in route.stops if stop.hold_seq in progress.skipped] == [cut]
    assert [stop.number for stop in progress.stops_done] == [n for n in range(1, 6) if n != cut]


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_holds_that_were_kept_are_not_named(firmware):
    assert not flown(firmware, [310.0] * 4).skipped
