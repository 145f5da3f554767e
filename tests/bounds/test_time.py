"""Certificates of mission time: what they prove, that no plan is below it, and that damage never proves more."""

import dataclasses
import functools
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.bounds import time
from mavplan.bounds.path import CertificateError
from mavplan.bounds.stored import prove_bound
from mavplan.bounds.time import TimeCertificate, from_json, highest_sum, proved_time_s, to_json
from mavplan.bounds.time_case import TimeCase
from mavplan.inflight import counts_in_flight
from mavplan.plan import make_plan
from mavplan.plan_file import dumps
from mavplan.planners import PLANNERS, plan_trajectory
from mavplan.planners.time_bound import time_bound
from mavplan.planners.time_certificate import time_certificate
from mavplan.planners.time_problem import TimeProblem
from mavplan.radio import planning_channel
from mavplan.scenario import UNPAIRED
from mavplan.stored_plan import parse_plan
from tests.support import make_scenario, mission_s_of, user_fields

OTHERS = tuple(name for name in PLANNERS if name != "time")


def with_service(scenario, in_flight):
    return dataclasses.replace(scenario, service=dataclasses.replace(scenario.service, in_flight=in_flight))


def case_of(scenario):
    return TimeCase.of(
        scenario.users,
        planning_channel(scenario),
        scenario.vehicle,
        scenario.service,
        wind=None,
        in_flight=counts_in_flight(scenario),
    )


def bounded(scenario, plans_m):
    """The bound aimed at the first of some plans."""
    problem = TimeProblem.of(
        scenario.users,
        planning_channel(scenario),
        scenario.vehicle,
        scenario.service,
        in_flight=counts_in_flight(scenario),
    )
    return time_bound(problem, case_of(scenario), plans_m, lambda: True)


def flown_s(scenario, name):
    """Time before rounding of the plan that a planner makes: its forecast and its hover programme."""
    planned = dataclasses.replace(
        scenario, planner=dataclasses.replace(scenario.planner, name=name, time_limit_s=1.0)
    )
    trajectory = plan_trajectory(planned)
    return mission_s_of(scenario, trajectory), trajectory.stops_m


@settings(max_examples=12)
@given(
    users=user_fields(most=9),
    demand_mbit=st.sampled_from([0.0, 5.0, 60.0, 400.0]),
    service=st.sampled_from(["broadcast", "in flight", "tdma"]),
    end=st.sampled_from(["rtl", "land", "stay"]),
    acceleration=st.sampled_from([None, 0.0, 1.0]),
    autopilot=st.sampled_from(["ardupilot", "px4"]),
    speed=st.sampled_from([4.0, 10.0, 15.0]),
)
def test_no_plan_of_any_planner_is_below_what_is_proved(
    users, demand_mbit, service, end, acceleration, autopilot, speed
):
    scenario = with_service(
        make_scenario(
            users.xy_m,
            pairs=[(one, mate) for one, mate in enumerate(users.mate) if one < mate],
            demand_mbit=demand_mbit,
            clusters=2,
            mode="tdma" if service == "tdma" else "broadcast",
            end=end,
            acceleration_m_s2=acceleration,
            autopilot=autopilot,
            speed_m_s=speed,
        ),
        service == "in flight",
    )
    times, stops = zip(*(flown_s(scenario, name) for name in OTHERS), strict=True)
    found = bounded(scenario, [stops[int(np.argmin(times))]])
    certificate = from_json(json.loads(json.dumps(to_json(time_certificate(found)))))
    proved_s = proved_time_s(certificate, case_of(scenario))
    assert found.seconds == pytest.approx(proved_s, rel=2e-3, abs=0.01)
    assert min(times) >= proved_s - 1e-6
    assert min(times) >= found.seconds - 1e-6


@functools.cache
def proof(in_flight=False, end="stay"):
    """A scenario, its bound's certificate and what that proves; the time of a good plan."""
    rng = np.random.default_rng(2)
    scenario = make_scenario(
        rng.uniform(0, 1500, (9, 2)), demand_mbit=60.0, acceleration_m_s2=0.0, end=end, pairs=[(0, 4)]
    )
    scenario = with_service(scenario, in_flight)
    plan_s, stops = flown_s(scenario, "time")
    certificate = time_certificate(bounded(scenario, [stops]))
    return scenario, certificate, proved_time_s(certificate, case_of(scenario)), plan_s


@pytest.mark.parametrize("in_flight", [False, True])
@pytest.mark.parametrize("end", ["rtl", "stay"])
def test_the_check_confirms_a_good_part_of_a_plan(in_flight, end):
    _, _, proved_s, plan_s = proof(in_flight, end)
    assert (0.6 if in_flight else 0.85) * plan_s < proved_s <= plan_s


def test_higher_prices_are_lowered_again_before_they_prove_anything():
    scenario, certificate, proved_s, _ = proof()
    for factor in (1.5, 100.0):
        dearer = dataclasses.replace(
            certificate, flat=factor * certificate.flat, steep=factor * certificate.steep
        )
        assert proved_time_s(dearer, case_of(scenario)) == pytest.approx(proved_s, rel=1e-3)


@settings(max_examples=60)
@given(data=st.data(), in_flight=st.booleans())
def test_damage_never_proves_more_than_the_best_plan_takes(data, in_flight):
    scenario, certificate, _, plan_s = proof(in_flight)
    content = to_json(certificate)
    for _ in range(data.draw(st.integers(1, 4))):
        what = data.draw(st.sampled_from(["share", "flat", "steep", "tree", "cut", "swap"]))
        if what == "share":
            content["share"] = data.draw(st.floats(0, 1))
        elif what in ("flat", "steep"):
            content[what][data.draw(st.integers(0, 8))] = data.draw(st.floats(0, 50))
        elif what == "cut":
            del content["tree"][data.draw(st.integers(0, len(content["tree"]) - 1))]
        elif what == "swap":
            one, other = (data.draw(st.integers(0, len(content["tree"]) - 1)) for _ in range(2))
            content["tree"][one], content["tree"][other] = content["tree"][other], content["tree"][one]
        else:
            at = data.draw(st.integers(0, len(content["tree"]) - 1))
            entry = content["tree"][at]
            if isinstance(entry, str) and entry:
                words = entry.split()
                words[data.draw(st.integers(0, len(words) - 1))] = str(
                    data.draw(st.integers(-(10**6), 10**6))
                )
                content["tree"][at] = " ".join(words)
            else:
                content["tree"][at] = data.draw(st.integers(-2, 10))
    try:
        proved_s = proved_time_s(from_json(json.loads(json.dumps(content))), case_of(scenario))
    except CertificateError:
        return
    assert proved_s <= plan_s + 1e-6


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "path"}, "kind 'path'"),
        ({"share": 0.5}, "out of range"),
        ({"share": "much"}, "not a certificate"),
        ({"flat": [0.1]}, "prices of 1"),
        ({"steep": [-1.0] * 9}, "out of range"),
        ({"tree": []}, "missing in the tree"),
        ({"tree": [99]}, "user 99"),
        ({"tree": [1, 1]}, "again"),
        ({"tree": [0, 4]}, "again"),
        ({"tree": ["", ""]}, "more entries"),
        ({"tree": ["1 2"]}, "vectors of shape"),
        ({"tree": ["1 x"]}, "not a certificate"),
        ({"tree": [True]}, "neither a user nor vectors"),
        ({"tree": None}, "not a certificate"),
    ],
)
def test_what_is_no_proof_is_refused_in_words(change, words):
    scenario, certificate, _, _ = proof()
    content = to_json(certificate) | change
    with pytest.raises(CertificateError, match=words):
        proved_time_s(from_json(content), case_of(scenario))


def test_a_proof_that_would_be_too_long_proves_less():
    rng = np.random.default_rng(3)
    scenario = with_service(
        make_scenario(rng.uniform(0, 2000, (14, 2)), demand_mbit=80.0, acceleration_m_s2=0.0), False
    )
    found = bounded(scenario, [flown_s(scenario, "tloaik")[1]])
    proved = [
        proved_time_s(time_certificate(found, most), case_of(scenario)) for most in (1, 20, 200, 100_000)
    ]
    assert proved == sorted(proved)
    assert proved[0] < proved[-1] == pytest.approx(found.seconds, rel=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_the_greatest_sum_of_prices_is_no_lower_than_any_sample_and_hardly_higher(seed):
    rng = np.random.default_rng(seed)
    scenario = make_scenario(rng.uniform(0, 1200, (7, 2)))
    case = case_of(scenario)
    flat, steep = rng.uniform(0, 1, 7), rng.uniform(0, 1, 7) * (rng.random(7) < 0.7)
    samples = np.vstack([case.users_xy_m, rng.uniform(-300, 1500, (50_000, 2))])
    away = np.linalg.norm(samples[:, None] - case.users_xy_m, axis=2)
    rates = case.channel.air_rate(away) / case.channel.air_rate(np.zeros(1))
    sums = (case.channel.reaches(away) * (flat + steep * rates)).sum(axis=1)
    assert sums.max() <= highest_sum(case, flat, steep) <= sums.max() * 1.05


def test_one_at_a_time_a_second_is_worth_no_more_than_it_takes():
    scenario = make_scenario(
        [[900, 0], [900, 300]], mode="tdma", demand_mbit=80.0, acceleration_m_s2=0.0, end="stay"
    )
    case = case_of(scenario)
    for price in (1.0, 3.0):
        certificate = TimeCertificate(0.0, np.full(2, price), np.zeros(2), (np.zeros((0, 2)),))
        assert proved_time_s(certificate, case) == pytest.approx(case.fixed_s + case.need_s.sum())


def test_the_proof_in_a_plans_file_is_checked_from_the_file_alone():
    rng = np.random.default_rng(5)
    scenario = make_scenario(rng.uniform(0, 1500, (8, 2)), pairs=[(1, 2)], planner="time", demand_mbit=30.0)
    scenario = dataclasses.replace(scenario, planner=dataclasses.replace(scenario.planner, time_limit_s=2.0))
    plane = dataclasses.replace(scenario, users=placed(scenario))
    plan = make_plan(plane)
    text = dumps(plan)
    found = prove_bound(parse_plan(text, "x"))
    assert found.stated.objective == "mission_s"
    assert found.proved == pytest.approx(plan.trajectory.bound.bound, rel=1e-3)
    data = json.loads(text)
    data["certificate"]["bound"] += 1.0
    with pytest.raises(CertificateError, match="not the"):
        prove_bound(parse_plan(json.dumps(data), "x"))
    data["certificate"]["bound"] = 0.0
    data["bound"]["plan"] = data["bound"]["bound"] - 10.0
    with pytest.raises(CertificateError, match="more than the"):
        prove_bound(parse_plan(json.dumps(data), "x"))


def placed(scenario):
    """The users with degrees that belong to their metres."""
    from mavplan.geo import LocalPlane

    users, home = scenario.users, scenario.home
    lat_deg, lon_deg = LocalPlane(home.lat_deg, home.lon_deg).to_lat_lon_deg(users.xy_m)
    return dataclasses.replace(users, lat_deg=lat_deg, lon_deg=lon_deg)


def test_nothing_here_asks_a_planner():
    import ast
    import inspect

    from mavplan.bounds import time_case

    for module in (time, time_case):
        tree = ast.parse(inspect.getsource(module))
        imported = {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        assert not [name for name in imported if "planners" in name]
    assert UNPAIRED == time_case.UNPAIRED
