"""A vehicle that stands elsewhere than the mission was planned for gets none of it."""

import math

import pytest
from pymavlink.dialects.v20 import common

from mavplan.errors import RefusedError
from mavplan.geo import geodesic_distance_m
from mavplan.link.codec import Codec
from mavplan.link.home import HomeQuery, distance_m
from mavplan.link.transfer import Pace
from mavplan.link.upload_session import UploadSession
from mavplan.mission.model import HomePosition
from tests.link.fenced import fenced, stored
from tests.link.harness import HOME, make_mission, make_network, run, upload
from tests.link.script import OTHER_STATION, VEHICLE, said

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
LAT, LON, ALT = HOME.lat_e7 / 1e7, HOME.lon_e7 / 1e7, HOME.alt_amsl_m


def sent_types(result):
    return {m.get_type() for _, frame in result.sent for m in Codec().decode(frame, 0.0)}


@BOTH
@pytest.mark.parametrize(
    ("home", "words"),
    [
        ((LAT + 0.01, LON, ALT), "1,112 m from the mission's"),
        ((LAT, LON, ALT + 31), "31 m above"),
        ((LAT, LON, ALT - 31), "31 m below"),
    ],
)
def test_a_vehicle_too_far_or_too_high_is_refused_before_anything_is_sent(firmware, home, words):
    network = make_network(firmware, home=home)
    result = upload(fenced(firmware), network)
    assert isinstance(result.error, RefusedError)
    assert words in str(result.error)
    assert not {kind for kind in sent_types(result) if kind.startswith("MISSION")}
    assert stored(network, 1) == ()


@BOTH
@pytest.mark.parametrize("home", [(LAT + 0.004, LON, ALT), (LAT, LON, ALT + 29), (LAT, LON, ALT - 29)])
def test_a_vehicle_nearby_gets_it(firmware, home):
    assert upload(make_mission(firmware, 1), make_network(firmware, home=home)).verified


@BOTH
def test_the_distance_can_be_chosen(firmware):
    network = make_network(firmware, home=(LAT + 0.01, LON, ALT + 100))
    session = UploadSession(
        make_mission(firmware, 1),
        now=network.clock_s,
        deadline_s=60.0,
        max_home_distance_m=1_200.0,
        max_home_height_m=100.5,
    )
    assert run(session, network).verified


@BOTH
def test_a_vehicle_without_a_home_is_warned_about_and_gets_it(firmware):
    result = upload(make_mission(firmware, 1), make_network(firmware, home=None))
    assert result.verified, result.error
    assert "no-home" in [problem.code for problem in result.session.report.warnings]


@BOTH
@pytest.mark.parametrize("seed", range(8))
def test_half_of_all_packets_lost_and_a_far_vehicle_is_still_refused(firmware, seed):
    network = make_network(firmware, "drop=0.5", seed=seed, home=(LAT + 0.01, LON, ALT))
    assert isinstance(upload(make_mission(firmware, 1), network).error, RefusedError)
    assert stored(network, 0) == ()


@pytest.mark.parametrize(
    "other",
    [(0.0, 0.0), (37.404, -122.1), (-37.4, 57.9), (89.9, 10.0), (37.4, -122.11), (0.0, 179.999)],
)
def test_the_distance_is_the_geodesics_to_half_a_percent(other):
    for start in [(37.4, -122.1), (0.0, -179.999), (-89.0, 0.0)]:
        places = [HomePosition(round(lat * 1e7), round(lon * 1e7), 0.0) for lat, lon in (start, other)]
        assert math.isclose(
            distance_m(*places), float(geodesic_distance_m(*start, *other)), rel_tol=0.0057, abs_tol=0.02
        )


def home_message(by=VEHICLE, lat=1, lon=2):
    return said(common.MAVLink_home_position_message(lat, lon, 3_500, 0, 0, 0, [1.0, 0, 0, 0], 0, 0, 0), by)


def test_only_the_vehicles_own_home_counts_and_0_0_is_none():
    query = HomeQuery(VEHICLE, Pace(), now=0.0, deadline=10.0)
    query.receive(home_message(OTHER_STATION), 0.1)
    query.receive(home_message(lat=0, lon=0), 0.1)
    assert not query.done
    query.receive(home_message(), 0.2)
    assert query.home == HomePosition(1, 2, 3.5)


def test_it_asks_until_time_is_over_and_then_gives_up():
    query = HomeQuery(VEHICLE, Pace(), now=0.0, deadline=10.0)
    asked = 0
    while (timer := query.next_timer()) is not None:
        query.tick(timer)
        asked += len(query.to_send())
    assert query.done
    assert query.home is None
    assert 10 <= asked <= 40
