"""How short a mission could be at best, for every plan of a problem: a lower bound with its proof.

`prices` says what is proved; here prices, their check in the plane and the search for the cheapest path take turns.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mavplan.bounds.time_case import TimeCase
from mavplan.planners.time_moves import candidate_places
from mavplan.planners.time_problem import TimeProblem
from mavplan.planners.toll_curve import Curve
from mavplan.planners.toll_plateau import Payers, Plateau, highest_sum
from mavplan.planners.toll_prices import PriceProgramme, Prices
from mavplan.planners.toll_problem import TollProblem, distances_m, reaching_all
from mavplan.planners.toll_search import TollSearch
from mavplan.scenario.model import UNPAIRED, Floats, Ints

ROUNDS = 14
"""Rounds of prices and cheapest paths."""

SETTLED = 5e-4
"""The rounds end when the programme promises less than this above what is proved, as a share."""

PATIENCE = 4
"""Rounds in a row that may gain nothing."""

SLACK = 5e-4
"""Share of the plan's time within which the cheapest path is searched."""

STEP = 0.6
"""Part of the way from the best prices so far to those of the programme: these swing."""

FIRST_NODES, ROUND_NODES, DEEPER, MOST_NODES = 300, 3_000, 4, 60_000
"""Of the search for the shortest path, of a round's for the cheapest one, how many times as many where that has not
found one that is cheaper than was promised, and of the best search when it goes on at last."""

TOUCH = 5e-4
"""The sum of prices may be found so far above what is allowed; then all prices are lowered by as much."""

CUTS = 6
"""Times that places where prices are too high are added to the programme in a round."""

LEAST_METRE_S = 1e-9
"""What a metre of the way costs where prices are for service alone: the search needs some cost."""

GRID = 6
"""Places in a row across R that the programme begins with."""


@dataclass(frozen=True, eq=False)
class TimeBound:
    """No plan takes less time.

    Attributes
    ----------
    seconds
        The bound, from take-off to the end.
    prices
        That prove it.
    search
        The tree that proves how cheap a path can be under them.
    constant_s
        What every mission takes beside the path that is searched for.
    paths
        (K, 2) points of cheapest paths met on the way: good plans stop near them.
    """

    seconds: float
    prices: Prices
    search: TollSearch
    constant_s: float
    paths: list[Floats]


def toll_problem(problem: TimeProblem, members: Ints, curve: Curve, prices: Prices) -> TollProblem:
    """Return the path problem that prices make of a mission-time problem.

    The toll of a pair is that of the member which is passed, for its own need, and its mate's need at the least that
    a second of either is worth.
    """
    flat, steep, need = prices.flat, prices.steep, problem.need_s
    worth = steep + flat * curve.values[0]
    one, other = members.T
    paired = one != other
    relayed = np.where(paired, np.minimum(worth[one], worth[other]), 0.0)
    fixed = np.stack(
        [steep[one] * need[one] + relayed * need[other], steep[other] * need[other] + relayed * need[one]],
        axis=1,
    )
    weights = np.stack([flat[one] * need[one], flat[other] * need[other]], axis=1)
    metre = max((1.0 - prices.share) / problem.speed_m_s, LEAST_METRE_S)
    end = None
    if problem.vehicle.end == "rtl":
        # From the last place passed to the last stop the way costs the one, from there home the other.
        end = min(metre, 1.0 / problem.return_m_s)
    return TollProblem(members, problem.users_m, fixed, weights, curve, metre, end)


def members_of(problem: TimeProblem) -> Ints:
    """Return (Q, 2) the users that may stand for each requirement: each user, or either of a pair."""
    users = np.arange(len(problem.users_m))
    mate = np.where(problem.mate == UNPAIRED, users, problem.mate)
    first = np.flatnonzero(users <= mate)
    return np.stack([users[first], mate[first]], axis=1)


def time_bound(
    problem: TimeProblem,
    case: TimeCase,
    plans_m: Sequence[Floats],
    keep_going: Callable[[], bool],
    go_round: Callable[[], bool] | None = None,
) -> TimeBound:
    """Return a lower bound on the time of every plan.

    Parameters
    ----------
    problem, case
        The same, for plans and for their bound.
    plans_m
        (M, 2) stops of good plans, the best first: the bound is aimed at its time, and the first prices at all.
    keep_going, go_round
        Asked before each piece of work whether there is time for it, and whether there is for better prices, which
        begin to search anew.
    """
    go_round = go_round or keep_going
    members, curve = members_of(problem), Curve.of(problem.channel)
    users = len(problem.need_s)
    plan_s = problem.takeoff_s + float(problem.times(plans_m[0][None]).total_s[0])
    paths: list[Floats] = []

    def proved(prices: Prices, promised_s: float, nodes: int = ROUND_NODES) -> TimeBound:
        beside = case.beside_s(prices.share)
        search = TollSearch(toll_problem(problem, members, curve, prices), plan_s - beside)

        def goes_on() -> bool:
            enough = nodes if search.cost + beside < promised_s else DEEPER * nodes
            return search.nodes < enough and go_round()

        search.run(SLACK * plan_s, goes_on)
        paths.extend(reaching_all(search.problem, points) for points in search.promising)
        return TimeBound(search.bound + beside, prices, search, beside, paths)

    def to_the_end(found: TimeBound) -> TimeBound:
        found.search.run(SLACK * plan_s, lambda: found.search.nodes < MOST_NODES and keep_going())
        return replace(found, seconds=found.search.bound + found.constant_s)

    if problem.tdma:
        return to_the_end(proved(Prices(np.ones(users), np.zeros(users), 0.0), np.inf))
    best = proved(Prices(np.zeros(users), np.zeros(users), 0.0), np.inf, FIRST_NODES)
    programme = PriceProgramme(problem.need_s, members, curve, problem.in_flight)
    programme.allow(problem.rates(_first_places(problem)))
    for stops in (*plans_m, *paths):
        _pass_by(problem, programme, stops)
    in_vain, hoped_s = 0, np.inf
    for round_ in range(ROUNDS):
        if not go_round() or in_vain >= PATIENCE:
            break
        prices, promised_s = _allowed(problem, programme)
        promised_s += case.beside_s(prices.share)
        if promised_s - best.seconds < SETTLED * plan_s:
            break
        before_s = best.seconds
        for tried in (best.prices.towards(prices, STEP), prices) if round_ else (prices,):
            met = len(paths)
            found = proved(tried, promised_s - SETTLED * plan_s)
            for points in paths[met:]:
                _pass_by(problem, programme, points)
            if found.seconds > best.seconds:
                best = found
                break
        if best.seconds == before_s and promised_s > hoped_s - 1e-9:
            break
        hoped_s = promised_s
        in_vain = 0 if best.seconds > before_s + SETTLED * plan_s else in_vain + 1
    return to_the_end(best)


def _pass_by(problem: TimeProblem, programme: PriceProgramme, points_m: Floats) -> None:
    """Tell the programme of a path through points (K, 2)."""
    path = np.vstack([np.zeros(2), points_m])
    way_s = float(np.sqrt((np.diff(path, axis=0) ** 2).sum(axis=1)).sum()) / problem.speed_m_s
    back_s = 0.0
    if problem.vehicle.end == "rtl":
        away_m = float(np.hypot(*path[-1]))
        if problem.in_flight:
            way_s += away_m / max(problem.speed_m_s, problem.return_m_s)
        else:
            back_s = away_m / max(problem.speed_m_s, problem.return_m_s)
    programme.pass_by(way_s, back_s, distances_m(points_m, problem.users_m))


def _first_places(problem: TimeProblem) -> Floats:
    """Return places at which the sum of prices is limited from the beginning."""
    step = problem.channel.radius_m / GRID
    low, high = problem.users_m.min(axis=0) - problem.channel.radius_m, problem.users_m.max(axis=0)
    east, north = (np.arange(low[k], high[k] + problem.channel.radius_m, step) for k in range(2))
    grid = np.stack(np.meshgrid(east, north), axis=-1).reshape(-1, 2)
    places = np.vstack([candidate_places(problem, np.random.default_rng(0)), grid])
    return places[(problem.rates(places) > 0).any(axis=1)]


def _allowed(problem: TimeProblem, programme: PriceProgramme) -> tuple[Prices, float]:
    """Return the programme's prices, and its promise, with places added until they are nowhere too high, or nearly."""
    prices, promised = programme.solve()
    for _ in range(CUTS):
        allowed = prices.share if problem.in_flight else 1.0
        if allowed <= 0.0:
            return prices, promised
        plateau = _plateau(problem, prices, allowed)
        if plateau.most <= allowed * (1 + 2 * TOUCH):
            return prices.lowered(plateau.most), promised
        programme.allow(problem.rates(plateau.peaks_m))
        prices, promised = programme.solve()
    return prices.lowered(_plateau(problem, prices, prices.share or 1.0).most), promised


def _plateau(problem: TimeProblem, prices: Prices, allowed: float) -> Plateau:
    return highest_sum(Payers(problem.users_m, prices.flat, prices.steep, problem.channel), allowed, TOUCH)
