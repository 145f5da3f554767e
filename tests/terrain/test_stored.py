"""A plan over real ground in its file: proved with the heights of users and stops, shown with the ground below."""

from dataclasses import replace

import numpy as np
import pytest

from mavplan.errors import InputError
from mavplan.geo import LocalPlane
from mavplan.plan import make_plan
from mavplan.plan_file import document, dumps, fingerprint
from mavplan.proof.prove import prove
from mavplan.report.content import report_content
from mavplan.report.page import render
from mavplan.scenario.sections import Service, TerrainOptions
from mavplan.stored_plan import parse_plan
from mavplan.terrain.grid import USER_M
from mavplan.track.read import parse_track
from tests.proof.plans import flight_of, places_m
from tests.support import HOME, make_scenario
from tests.terrain.hills import bilinear, flat, ridge, terrain_of
from tests.track.logs import to_tlog

USERS = [(100, 500), (900, 300), (1000, -300)]


def made(terrain, xy_m=USERS, *, pairs=(), **options):
    """A plan over real ground."""
    scenario = make_scenario(xy_m, pairs=pairs, **{"position_error_m": 1.0, **options})
    lat_deg, lon_deg = LocalPlane(HOME.lat_deg, HOME.lon_deg).to_lat_lon_deg(scenario.users.xy_m)
    users = replace(scenario.users, lat_deg=lat_deg, lon_deg=lon_deg)
    given = TerrainOptions(file="hills.tif")
    return make_plan(replace(scenario, users=users, terrain=terrain, terrain_options=given))


def flown(plan, **options):
    """A recorded flight along a plan: above home at the take-off's height, at each stop at its own."""
    flight = flight_of(plan, **options)
    places = np.vstack([np.zeros((1, 2)), places_m(plan)])
    near = np.linalg.norm(flight.xyz_m[:, None, :2] - places[None], axis=2).argmin(axis=1)
    heights = np.array([100.0, *(stop.alt_rel_m for stop in plan.stops)])[near]
    share = flight.xyz_m[:, 2] / plan.scenario.vehicle.altitude_m
    xyz_m = np.column_stack([flight.xyz_m[:, :2], heights * share])
    return parse_track(to_tlog(replace(flight, xyz_m=xyz_m)), "x")


def gorge(step_m=-150.0):
    """Level ground that drops at 570 m east."""
    heights = np.full((201, 201), 600.0)
    heights[:, 119:] += step_m
    return terrain_of(heights)


@pytest.mark.parametrize("mode", ["broadcast", "tdma"])
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_flight_as_planned_meets_every_demand_where_stops_differ_in_height(mode, autopilot):
    terrain = ridge(top_m=700.0, at_m=600.0, width_m=400.0)
    plan = parse_plan(dumps(made(terrain, mode=mode, autopilot=autopilot)), "x")
    heights = [stop.alt_rel_m for stop in plan.stops]
    assert max(heights) - min(heights) > 10
    proof = prove(plan, flown(plan))
    assert proof.all_met
    assert proof.reasons == {}


def test_what_a_user_is_proved_to_get_is_that_of_its_distance_in_space():
    """One stop over a gorge, 50 m below home's level: by hand, from the place and the height of the hold."""
    plan = parse_plan(dumps(made(gorge(), [(1000.0, 0.0)])), "x")
    (stop,) = plan.stops
    assert stop.alt_rel_m == -50.0
    proof = prove(plan, flown(plan))
    apart = places_m(plan)[0] - [1000.0, 0.0]
    slant_m = np.sqrt(apart @ apart + (stop.alt_rel_m - (-150.0 + USER_M)) ** 2)
    radio = plan.scenario.radio
    snr = 10 ** ((radio.tx_power_dbm + radio.ref_gain_db - radio.noise_dbm) / 10) / slant_m**2
    expected = stop.hold_s * radio.bandwidth_hz * np.log2(1 + snr)
    assert proof.hover_bit[0] == pytest.approx(expected, rel=0.01)
    assert proof.all_met


def test_a_flight_lower_than_its_stop_does_not_count():
    plan = parse_plan(dumps(made(ridge(top_m=700.0, at_m=600.0, width_m=400.0))), "x")
    track = flown(plan)
    low = prove(plan, replace(track, alt_rel_m=track.alt_rel_m - 20.0))
    assert not low.met.any()


def test_a_hidden_user_gets_nothing_from_the_stop_that_does_not_see_it():
    heights = np.full((201, 201), 600.0)
    heights[:, 110:112] = 690.0
    made_plan = made(terrain_of(heights), [(0, 0), (400, 0)])
    plan = parse_plan(dumps(made_plan), "x")
    assert plan.hidden.any()
    assert (plan.hidden == made_plan.links.hidden).all()
    proof = prove(plan, flown(plan))
    assert proof.all_met
    seen = replace(plan, hidden=np.zeros_like(plan.hidden))
    assert (prove(seen, flown(plan)).hover_bit > proof.hover_bit + 1e6).any()


def test_a_mate_relays_only_what_it_hears():
    """The D2D user's mate: what is proved of both is not less than asked, and counts no stop that is hidden."""
    heights = np.full((201, 201), 600.0)
    heights[:, 110:112] = 690.0
    plan = parse_plan(dumps(made(terrain_of(heights), [(0, 0), (400, 0), (900, 0)], pairs=[(1, 2)])), "x")
    proof = prove(plan, flown(plan))
    assert proof.all_met
    blind = replace(plan, hidden=np.ones_like(plan.hidden))
    assert not prove(blind, flown(plan)).met.any()


def test_nothing_counts_in_flight_over_real_ground():
    plan = parse_plan(dumps(made(flat())), "x")
    with pytest.raises(InputError, match="hide users in flight"):
        prove(plan, flown(plan), in_flight=True)


def test_the_file_has_the_ground_of_every_user_and_below_every_leg():
    terrain = ridge(top_m=750.0, at_m=600.0, width_m=150.0)
    plan = made(terrain)
    content = document(plan)
    for user, xy_m in zip(content["users"], USERS, strict=True):
        assert user["ground_rel_m"] == pytest.approx(
            bilinear(terrain, xy_m)[0] - bilinear(terrain, (0, 0))[0], abs=0.01
        )
    assert max(max(leg["ground_rel_m"]) for leg in content["ground"]) == pytest.approx(150.0, abs=0.5)
    assert content["scenario"]["terrain"]["file"] == "hills.tif"
    other = replace(plan.scenario, terrain=ridge(top_m=751.0, at_m=600.0, width_m=150.0))
    assert fingerprint(other) != fingerprint(plan.scenario)
    assert "ground" not in document(make_plan(make_scenario(USERS)))


def test_the_report_draws_the_ground_below_the_flight():
    made_plan = made(ridge(top_m=750.0, at_m=600.0, width_m=150.0))
    plan = parse_plan(dumps(made_plan), "x")
    content = report_content(made_plan.built.mission, plan, "hills")
    times, ground = np.array(content.ground).T
    profile = np.array(content.profile)
    assert (np.diff(times) >= 0).all()
    assert ground.max() == pytest.approx(150.0, abs=0.5)
    in_air = (times > profile[1, 0] + 1) & (times < profile[-2, 0] - 1)
    assert (np.interp(times[in_air], *profile.T) - ground[in_air]).min() > 25.0
    assert [user.gets_mbit >= 9.99 for user in content.users] == [True] * 3
    assert 'class="ground"' in render(content)
    plain = make_plan(make_scenario(USERS))
    without = report_content(plain.built.mission, parse_plan(dumps(plain), "x"), "plain")
    assert 'class="ground"' not in render(without)


def test_a_plan_over_real_ground_is_not_made_again_without_it():
    plan = parse_plan(dumps(made(flat())), "x")
    with pytest.raises(InputError, match="was not read"):
        make_plan(plan.scenario)


def test_in_flight_service_is_not_counted_over_real_ground():
    plan = made(flat())
    counting = replace(plan.scenario, service=Service(in_flight=True))
    assert make_plan(counting).holds.in_flight_bit is None
