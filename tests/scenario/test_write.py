"""A scenario that was written is read back as the same."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.mission.geofence import Fence, FenceCircle, FencePolygon, RallyPoint
from mavplan.plan_file import fingerprint
from mavplan.scenario import (
    D2D,
    UNPAIRED,
    Home,
    PlannerOptions,
    Radio,
    Scenario,
    Service,
    Users,
    Vehicle,
    load_scenario,
)
from mavplan.scenario.sections import FenceOptions
from mavplan.scenario.write import scenario_toml, users_csv

GALLERY = Path(__file__).resolve().parents[2] / "missions"


def back(scenario, folder):
    """The scenario after writing and reading."""
    (folder / "scenario.toml").write_text(scenario_toml(scenario, "users.csv", "a remark\n\nof two lines"))
    (folder / "users.csv").write_text(users_csv(scenario.users))
    return load_scenario(folder / "scenario.toml")


@pytest.mark.parametrize("name", ["valley", "coast", "hppp60"])
def test_the_gallery_comes_back_as_it_was(name, tmp_path):
    scenario = load_scenario(GALLERY / name / "scenario.toml")
    assert fingerprint(back(scenario, tmp_path)) == fingerprint(scenario)


def test_a_fence_zones_and_rally_points_come_back(tmp_path):
    scenario = load_scenario(GALLERY / "valley" / "scenario.toml")
    ring = (
        (465_000_000, 78_000_000),
        (466_500_000, 78_000_000),
        (466_500_000, 80_000_000),
        (465_000_000, 80_000_000),
    )
    school = ((465_100_000, 78_100_000), (465_200_000, 78_100_000), (465_200_000, 78_200_000))
    scenario = replace(
        scenario,
        fence=Fence((FencePolygon(True, ring),), (FenceCircle(False, 466_000_001, 79_400_000, 50.5),)),
        no_fly=Fence(
            (FencePolygon(False, school, "school"),), (FenceCircle(False, 466_000_001, 79_600_000, 20.0),)
        ),
        fence_options=FenceOptions(max_alt_rel_m=140.0, margin_m=1.5),
        rally=(
            RallyPoint(465_830_000, 79_098_000, 40.0, 'a "meadow"'),
            RallyPoint(465_840_000, 79_098_000, 30.0),
        ),
    )
    found = back(scenario, tmp_path)
    assert found.no_fly == scenario.no_fly
    assert found.no_fly.polygons[0].name == "school"
    assert (found.fence, found.rally, found.fence_options) == (
        scenario.fence,
        scenario.rally,
        scenario.fence_options,
    )


names = st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"]), min_size=1, max_size=12)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(
        st.tuples(names, st.floats(-0.02, 0.02), st.floats(-0.02, 0.02), st.integers(0, 10**12)),
        min_size=1, max_size=6, unique_by=lambda user: user[0],
    ),
    st.booleans(),
    st.sampled_from(["broadcast", "tdma"]),
    st.one_of(st.none(), st.floats(0.1, 5.0)),
)  # fmt: skip
def test_any_scenario_comes_back_as_it_was(tmp_path_factory, drawn, paired, mode, acceleration):
    count = len(drawn)
    mate = np.full(count, UNPAIRED, dtype=np.int64)
    if paired and count > 1:
        mate[0], mate[count - 1] = count - 1, 0
    scenario = Scenario(
        home=Home(46.5, 7.5, 600.0),
        users=Users(
            tuple(name for name, *_ in drawn),
            np.array([46.5 + lat for _, lat, *_ in drawn]),
            np.array([7.5 + lon for _, _, lon, _ in drawn]),
            np.zeros((count, 2)),
            np.array([float(bits) for *_, bits in drawn]),
            mate,
        ),
        radio=Radio(tx_power_dbm=23.5),
        d2d=D2D(matching="given" if paired and count > 1 else "none", range_m=20_000.0),
        vehicle=Vehicle(autopilot="px4", acceleration_m_s2=acceleration, end="land"),
        service=Service(mode=mode),
        planner=PlannerOptions(name="stoaik", clusters=3, seed=7),
    )
    found = back(scenario, tmp_path_factory.mktemp("scenario"))
    assert found.users.names == scenario.users.names
    np.testing.assert_allclose(found.users.demand_bit, scenario.users.demand_bit, rtol=1e-15)
    assert fingerprint(
        replace(found, users=replace(found.users, demand_bit=scenario.users.demand_bit))
    ) == fingerprint(scenario)
