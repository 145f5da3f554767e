"""Scenarios with everything round them that a picture may show."""

from dataclasses import replace

import numpy as np
import pytest

from mavplan.geo import LocalPlane
from mavplan.mission.geofence import Fence, FenceCircle, FencePolygon, RallyPoint
from mavplan.scenario.sections import PinnedStop
from tests.support import HOME, make_scenario

pytest.importorskip("matplotlib", reason="pictures need matplotlib (extra 'figures')")

PLANE = LocalPlane(HOME.lat_deg, HOME.lon_deg)
LONG = (
    "Die lange Wegstrecke hinter dem Wald bei der alten Mühle an der oberen Brücke neben dem Spritzenhaus 7"
)
"""A name of 102 letters."""
CHINESE = "救援隊第一"


def polygon(inclusion, *corners_m):
    """An area with these corners."""
    lat, lon = PLANE.to_e7(np.array(corners_m, dtype=float))
    return FencePolygon(inclusion, tuple(zip(lat.tolist(), lon.tolist(), strict=True)))


def circle(x_m, y_m, radius_m):
    """A round area to stay out of."""
    lat, lon = PLANE.to_e7(np.array([[x_m, y_m]]))
    return FenceCircle(False, int(lat[0]), int(lon[0]), radius_m)


AIRFIELD = polygon(False, (-300, 300), (500, 300), (500, 900), (-300, 900))
"""Between home and the users in the north."""


def named(scenario, *names):
    """The scenario with these names for its first users."""
    users = scenario.users
    return replace(scenario, users=replace(users, names=(*names, *users.names[len(names) :])))


def with_all(scenario):
    """The scenario with an airfield, a fence with a hole, a rally point and a pinned stop."""
    lat, lon = PLANE.to_lat_lon_deg(np.array([[-900.0, 200.0], [900.0, 200.0]]))
    fence = Fence(
        (polygon(True, (-2500, -700), (2500, -700), (2500, 2300), (-2500, 2300)),), (circle(1500, -300, 80),)
    )
    return replace(
        scenario,
        no_fly=Fence((AIRFIELD,)),
        fence=fence,
        rally=(RallyPoint(round(lat[0] * 1e7), round(lon[0] * 1e7), 30.0),),
        stops=(PinnedStop(float(lat[1]), float(lon[1]), name="marker", hold_s=5.0),),
    )


@pytest.fixture
def surrounded():
    """Users north of an airfield that lies before home, and all there may be round it."""
    return with_all(make_scenario([(0, 1500), (300, 1600), (-1500, 1200)]))


@pytest.fixture
def crowd():
    """25 users, some of them with names that run far or that not every font has."""
    xy_m = np.random.default_rng(3).uniform(-1800, 1800, (25, 2)).round(1)
    return named(make_scenario(xy_m, clusters=6), LONG, "Pfarrhaus Öttl", "Rettung $1_x^2$")


@pytest.fixture
def matplotlib_alone(monkeypatch):
    """No fonts but those that come with matplotlib."""
    from mavplan.figures import fonts

    monkeypatch.setattr(fonts, "FALLBACKS", ())
    monkeypatch.setattr(fonts, "OTHERS", ())
    fonts.families.cache_clear()
    yield
    fonts.families.cache_clear()
