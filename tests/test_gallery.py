"""missions/: every example is a sound scenario, shows what its README says, and can be drawn again."""

import importlib.util
from pathlib import Path

import pytest

from mavplan.planners import plan_trajectory
from mavplan.scenario import load_scenario

GALLERY = Path(__file__).resolve().parents[1] / "missions"
EXAMPLES = sorted(path.parent.name for path in GALLERY.glob("*/scenario.toml"))


def load(name):
    return load_scenario(GALLERY / name / "scenario.toml")


def test_the_three_examples_are_there():
    """A valley, sixty random users, a coast."""
    assert {"valley", "hppp60", "coast"} <= set(EXAMPLES)


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_example_can_be_read_and_says_what_it_shows(name):
    """Scenario, users and a README that names the command."""
    assert len(load(name).users) >= 1
    readme = (GALLERY / name / "README.md").read_text(encoding="utf-8")
    assert f"mavplan plan missions/{name}/scenario.toml" in readme


def test_the_valley_is_a_dozen_users_with_pairs_for_ardupilot():
    """From CSV, and within the battery that it gives."""
    scenario = load("valley")
    assert len(scenario.users) == 12
    assert (scenario.users.mate >= 0).sum() == 4
    assert scenario.vehicle.autopilot == "ardupilot"
    assert scenario.vehicle.endurance_s is not None
    assert scenario.warnings == ()


def test_the_coast_is_many_pairs_for_px4():
    """From GeoJSON with its own property names; two demands are left out."""
    scenario = load("coast")
    assert (scenario.users.mate >= 0).sum() == 22
    assert scenario.vehicle.autopilot == "px4"
    assert [problem.code for problem in scenario.warnings] == ["default-demand"]


@pytest.mark.parametrize("name", ["valley", "coast"])
def test_the_default_radio_needs_a_handful_of_stops(name):
    """4 to 15, and some user is served through its mate."""
    trajectory = plan_trajectory(load(name))
    assert 4 <= len(trajectory.stops_m) <= 15
    assert trajectory.assignment.d2d.any()


def test_the_sixty_users_are_drawn_again_from_their_seed():
    """draw.py writes the very file that is there."""
    spec = importlib.util.spec_from_file_location("draw", GALLERY / "hppp60/draw.py")
    draw = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(draw)
    assert draw.users_csv() == (GALLERY / "hppp60/users.csv").read_text(encoding="utf-8")
    scenario = load("hppp60")
    assert (scenario.home.lat_deg, scenario.home.lon_deg) == (draw.HOME_LAT_DEG, draw.HOME_LON_DEG)
    assert len(scenario.users) == 60
    assert (scenario.users.mate >= 0).all()
    assert ((scenario.users.xy_m >= -0.02) & (scenario.users.xy_m <= draw.SIDE_M + 0.02)).all()
