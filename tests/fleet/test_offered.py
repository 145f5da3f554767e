"""Users whom one vehicle's battery leaves over, offered to the others."""

import dataclasses

import numpy as np
import pytest

from mavplan.fleet import make
from mavplan.fleet.make import plan_fleet
from mavplan.geo import LocalPlane
from mavplan.scenario.sections import FleetVehicle, PinnedStop
from mavplan.sorties.make import plan_sorties
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


@pytest.mark.parametrize("seed", [0, 3, 4, 35])
def test_whom_a_pinned_stop_is_above_no_other_vehicle_serves(seed):
    scenario = short_of_batteries(seed, own_homes=True)
    users = scenario.users
    stops = tuple(
        PinnedStop(float(users.lat_deg[n]), float(users.lon_deg[n]), users.names[n], f"pin {n}")
        for n in (2, 7)
    )
    lasting = dataclasses.replace(scenario.vehicle, endurance_s=900.0)
    fleet = plan_fleet(dataclasses.replace(scenario, stops=stops, vehicle=lasting), 2, sorties=True, most=1)
    for plan in fleet.plans:
        flown = {stop.user for stop in plan.scenario.stops}
        others = {name for other in fleet.plans if other is not plan for name in other.scenario.users.names}
        assert not flown & others
    assert {stop.user for plan in fleet.plans for stop in plan.scenario.stops} == {
        users.names[2],
        users.names[7],
    }


@pytest.mark.parametrize("vehicles", [1, 2])
def test_a_user_whom_no_battery_reaches_changes_nothing_for_the_others(vehicles):
    near = short_of_batteries(3, own_homes=False)
    plane = LocalPlane(HOME.lat_deg, HOME.lon_deg)
    xy_m = np.vstack([near.users.xy_m, [(25_000.0, 0.0)]])
    lat_deg, lon_deg = plane.to_lat_lon_deg(xy_m)
    far = make_scenario(
        xy_m, demand_mbit=120.0, clusters=5, endurance_s=near.vehicle.endurance_s, mass_kg=2.0
    )
    priority = np.append(near.users.priority, 3.0)
    users = dataclasses.replace(far.users, lat_deg=lat_deg, lon_deg=lon_deg, priority=priority)
    far = dataclasses.replace(far, users=users)
    with_it, without = (plan_fleet(one, vehicles, sorties=True, most=1) for one in (far, near))
    assert with_it.not_served == (*without.not_served, users.names[-1])
    assert with_it.rest is not None
    assert set(with_it.rest.users.names) >= {users.names[-1]}
    for one, other in zip(with_it.plans, without.plans, strict=True):
        assert one.built.mission.items == other.built.mission.items
        assert one.part.not_served == with_it.not_served
    if vehicles == 1:
        alone = plan_sorties(far, most=1)
        assert alone.not_served == with_it.not_served
        assert [plan.part.not_served for plan in alone.plans] == [with_it.not_served]
        assert alone.plans[0].built.mission.items == with_it.plans[0].built.mission.items
