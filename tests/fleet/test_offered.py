"""Users whom one vehicle's battery leaves over, offered to the others."""

import dataclasses

import numpy as np
import pytest

from mavplan.fleet import make
from mavplan.fleet.make import plan_fleet
from mavplan.geo import LocalPlane
from mavplan.scenario.sections import FleetVehicle
from tests.support import HOME, make_scenario


def short_of_batteries(seed, own_homes):
    """Ten users of different worth over 3.6 km, two vehicles that cannot serve them all in a sortie each."""
    rng = np.random.default_rng(seed)
    plane = LocalPlane(HOME.lat_deg, HOME.lon_deg)
    endurance_s = float(rng.uniform(450, 800))
    scenario = make_scenario(
        rng.uniform(-1800, 1800, (10, 2)), demand_mbit=120.0, clusters=5, endurance_s=endurance_s, mass_kg=2.0
    )
    lat_deg, lon_deg = plane.to_lat_lon_deg(scenario.users.xy_m)
    priority = rng.uniform(0, 5, 10)
    users = dataclasses.replace(scenario.users, lat_deg=lat_deg, lon_deg=lon_deg, priority=priority)
    homes = np.stack(plane.to_lat_lon_deg(rng.uniform(-1200, 1200, (2, 2))), axis=1).tolist()
    vehicles = tuple(FleetVehicle(lat, lon, 0.0, name) for (lat, lon), name in zip(homes, "ab", strict=True))
    return dataclasses.replace(scenario, users=users, vehicles=vehicles if own_homes else ())


def left_bit(scenario, fleet):
    return float(scenario.users.weighted_bit[scenario.users.named(fleet.not_served)].sum())


@pytest.mark.parametrize("own_homes", [False, True])
@pytest.mark.parametrize("sorties", [1, 2])
def test_offering_leaves_no_more_over_and_everybody_is_served_once_or_named(monkeypatch, own_homes, sorties):
    better = 0
    for seed in range(4):
        scenario = short_of_batteries(seed, own_homes)
        fleet = plan_fleet(scenario, 2, sorties=True, most=sorties)
        served = {}
        for plan in fleet.plans:
            assert plan.forecast.mission_s <= scenario.vehicle.endurance_s * 0.8
            assert plan.part.not_served == fleet.not_served
            for name in plan.scenario.users.names:
                served.setdefault(name, set()).add(plan.part.number)
        assert all(len(vehicles) == 1 for vehicles in served.values())
        assert {*served, *fleet.not_served} == set(scenario.users.names)
        assert len(served) + len(fleet.not_served) == len(scenario.users)
        with monkeypatch.context() as patch:
            patch.setattr(make, "offered", lambda cut, *_: cut)
            without = plan_fleet(scenario, 2, sorties=True, most=sorties)
        assert left_bit(scenario, fleet) <= left_bit(scenario, without) + 1
        better += left_bit(scenario, fleet) < left_bit(scenario, without) - 1
    assert better or not own_homes or sorties > 1
