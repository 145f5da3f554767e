"""Hundreds of transfers over bad radios: no outcome is untrue, none comes after its deadline.

Thousands run by ``python -m benchmarks.transfers``, with a judge that shares nothing with the client.
"""

import random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavplan.errors import InputError, NoLinkError, RefusedError, UncertainError
from tests.link.harness import Run, make_mission, make_network, upload

CHOICES: dict[str, tuple[str, ...]] = {
    "drop": ("0.1", "0.3", "0.5"),
    "drop-up": ("0.3", "0.5"),
    "drop-down": ("0.3", "0.5"),
    "dup": ("0.2", "0.5", "1"),
    "reorder": ("0.2", "0.5"),
    "delay": ("50ms", "200ms", "500ms"),
    "jitter": ("100ms", "500ms"),
    "corrupt": ("0.01", "0.1"),
    "first-lost": ("",),
    "ack-lost": ("1", "3"),
    "early-ack": ("",),
    "reboot-at": ("1", "5", "12", "3s"),
    "silent-after": ("1", "7", "5s"),
    "second-gcs": ("read", "upload"),
    "alter": ("2",),
    "nack": ("ERROR", "DENIED", "NO_SPACE", "INVALID_SEQUENCE", "UNSUPPORTED"),
    "no-heartbeat": ("",),
}
RARE = frozenset({"silent-after", "alter", "nack", "no-heartbeat"})


def written(faults: dict[str, str]) -> str:
    # A reading second station answers every copy of an item with a request of its own: doubling would never end.
    if faults.get("second-gcs") == "read":
        faults = {name: value for name, value in faults.items() if name != "dup"}
    return ",".join(f"{name}={value}" if value else name for name, value in faults.items())


def check(firmware: str, stops: int, faults: str, seed: int, deadline_s: float) -> Run:
    """One upload; raises where the outcome is untrue."""
    case = f"{firmware}, {stops} stops, {faults!r}, seed {seed}, {deadline_s:g} s"
    mission, network = make_mission(firmware, stops), make_network(firmware, faults, seed)
    result = upload(mission, network, deadline_s=deadline_s)
    assert result.ended_s <= deadline_s + 1e-3, f"beyond the deadline: {case}"
    assert result.verified != (result.error is not None), case
    if result.verified:
        assert result.holds(mission), f"called verified, but the vehicle holds something else: {case}"
    else:
        assert isinstance(result.error, (InputError, NoLinkError, RefusedError, UncertainError)), case
        assert "\n" not in str(result.error), case
    return result


def random_case(chance: random.Random) -> tuple[str, int, str, int, float]:
    faults = {
        name: chance.choice(values)
        for name, values in CHOICES.items()
        if chance.random() < (0.05 if name in RARE else 0.2)
    }
    firmware, stops = chance.choice(["ardupilot", "px4"]), chance.choice([0, 1, 3, 10, 24])
    return firmware, stops, written(faults), chance.randrange(10**6), chance.choice([10.0, 60.0, 200.0])


@pytest.mark.parametrize("part", range(8))
def test_no_outcome_is_untrue_and_none_comes_late_whatever_goes_wrong(part):
    chance = random.Random(part)
    for _ in range(15):
        check(*random_case(chance))


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.sampled_from(["ardupilot", "px4"]),
    st.integers(0, 6),
    st.fixed_dictionaries({}, optional={name: st.sampled_from(values) for name, values in CHOICES.items()}),
    st.integers(0, 2**32),
    st.sampled_from([10.0, 60.0, 200.0]),
)
def test_no_combination_of_faults_makes_an_outcome_untrue(firmware, stops, faults, seed, deadline_s):
    check(firmware, stops, written(faults), seed, deadline_s)


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
@pytest.mark.parametrize(("drop", "limit_s"), [(0.3, 120.0), (0.5, 300.0)])
def test_fifty_items_get_through_at_a_third_and_at_half_of_all_packets_lost(firmware, drop, limit_s):
    for seed in range(12):
        assert check(firmware, 24, f"drop={drop}", seed, limit_s).verified


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
@pytest.mark.parametrize("faults", ["dup=0.2", "dup=1", "reorder=0.3", "dup=0.3,reorder=0.5"])
def test_doubling_and_overtaking_have_no_effect_on_the_outcome(firmware, faults):
    for seed in range(5):
        assert check(firmware, 24, faults, seed, 120.0).verified
