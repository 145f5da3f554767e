"""Plans to hold flights to: made by mavplan, or written by hand for a recorded flight; and flights along a plan."""

import json
from dataclasses import replace

import numpy as np

from mavplan.geo import LocalPlane
from mavplan.plan import make_plan
from mavplan.plan_file import dumps
from mavplan.stored_plan import parse_plan
from tests.support import HOME, make_scenario
from tests.track.logs import fly

RADIO = {
    "tx_power_dbm": 20.0,
    "ref_gain_db": -70.0,
    "noise_dbm": -105.3045,
    "path_loss_exponent": 2.0,
    "snr_threshold_db": 3.0,
    "bandwidth_hz": 1e6,
}


def stored(xy_m, **options):
    """A plan for users at these places, as `make_scenario` takes them, read back from its file."""
    scenario = make_scenario(xy_m, **{"position_error_m": 1.0, **options})
    lat_deg, lon_deg = LocalPlane(HOME.lat_deg, HOME.lon_deg).to_lat_lon_deg(scenario.users.xy_m)
    scenario = replace(scenario, users=replace(scenario.users, lat_deg=lat_deg, lon_deg=lon_deg))
    return parse_plan(dumps(make_plan(scenario)), "x.mavplan.json")


def by_hand(stops, users, *, home, autopilot="ardupilot", altitude_m=30.0, mode="broadcast", schedule=()):
    """A plan as a file would hold it.

    ``stops``: (latitude, longitude, hold, first, hold item); ``users``: (name, latitude, longitude, Mbit, stop, mate);
    a user with a mate of a greater number is served through it.
    """
    names = [user[0] for user in users]
    document = {
        "format": "mavplan",
        "version": 1,
        "planner": "tloaik",
        "autopilot": autopilot,
        "flight_s": 100.0,
        "hover_s": sum(stop[2] for stop in stops),
        "mission_s": 100.0 + sum(stop[2] for stop in stops),
        "stops": [
            {"lat_deg": lat, "lon_deg": lon, "alt_rel_m": altitude_m, "hold_s": hold_s}
            for lat, lon, hold_s, _, _ in stops
        ],
        "stop_items": [{"first": first, "hold": hold} for *_, first, hold in stops],
        "users": [
            {
                "name": name,
                "lat_deg": lat,
                "lon_deg": lon,
                "demand_mbit": mbit,
                "stop": stop,
                "mate": mate,
                "via": "d2d" if mate is not None and names.index(mate) > names.index(name) else "air",
            }
            for name, lat, lon, mbit, stop, mate in users
        ],
        "schedule": [
            {"stop": stop, "user": user, "start_s": start_s, "duration_s": duration_s}
            for stop, user, start_s, duration_s in schedule
        ],
        "scenario": {
            "home": {"lat_deg": home[0], "lon_deg": home[1], "alt_amsl_m": 10.0},
            "radio": RADIO,
            "d2d": {"matching": "given"},
            "vehicle": {"autopilot": autopilot, "altitude_m": altitude_m},
            "service": {"mode": mode},
            "planner": {},
        },
    }
    return parse_plan(json.dumps(document), "x.mavplan.json")


def places_m(plan):
    """The stops in metres."""
    home = plan.scenario.home
    return LocalPlane(home.lat_deg, home.lon_deg).to_xy_m(
        [stop.lat_deg for stop in plan.stops], [stop.lon_deg for stop in plan.stops]
    )


def flight_of(plan, *, holds_s=None, stops_m=None, **options):
    """A flight along a plan; other holds or other places where they are given."""
    home = plan.scenario.home
    flight = fly(
        places_m(plan) if stops_m is None else stops_m,
        plan.hold_s if holds_s is None else holds_s,
        height_m=plan.scenario.vehicle.altitude_m,
        autopilot=plan.autopilot,
        items=[(stop.items.first, stop.items.hold) for stop in plan.stops],
        **options,
    )
    return replace(flight, home=(home.lat_deg, home.lon_deg, home.alt_amsl_m))


def moved(places, stop, by_m):
    """The places with one of them moved east."""
    places = np.array(places)
    places[stop, 0] += by_m
    return places
