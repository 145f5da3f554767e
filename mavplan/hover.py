"""Hover times: how long the vehicle holds at each stop so that every user receives what it needs.

Broadcast: everyone in reach receives at its own rate at the same time, a linear programme. TDMA: one user at a time,
where its rate is highest. A user served through D2D puts its demand on its mate. Where the scenario counts in-flight
service, the vehicle holds for what is then still needed. Pinned stops have a least hold. Pure; what an autopilot can
store comes from its table.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mavplan.errors import InputError, Problem
from mavplan.inflight import counts_in_flight, received_in_flight
from mavplan.mission.autopilots import AutopilotRules
from mavplan.planners.pinned import NO_PIN, pins_of
from mavplan.planners.trajectory import Trajectory
from mavplan.radio import Channel, planning_channel
from mavplan.scenario.model import Floats, Ints, Scenario, Users

if TYPE_CHECKING:
    from scipy.sparse import csr_array

WORTHWHILE = 0.02
"""Where rounding up adds more than this share, whole steps are optimised themselves."""

SEARCH_NODES = 200
SEARCH_GAP = 1e-3
"""Bounds of that search, counted and not timed, so that a plan is the same on every machine."""

ROUNDING_S = 1e-7
"""Seconds that arithmetic may add or take."""

WIDER = 1e-6
"""Part of R, and metres, by which neighbours are looked for farther away than they may be."""

DEMAND_TOLERANCE_BIT = 1.0
"""A demand short of less than this is met: what a solver's last digits cost must not add a whole step."""


@dataclass(frozen=True, slots=True)
class Slot:
    """One user's turn in a TDMA schedule, in seconds from the beginning of the hold at ``stop``."""

    stop: int
    user: int
    start_s: float
    duration_s: float


@dataclass(frozen=True, eq=False)
class Holds:
    """Seconds at each of M stops.

    Attributes
    ----------
    asked_s
        (M,) what the demands take at least.
    stored_s
        (M,) what the autopilot is given: whole steps of its clock, at least its least hold.
    schedule
        TDMA: who is served when; empty for broadcast.
    in_flight_bit
        (N,) what each user receives on the legs; None where that is not counted.
    """

    asked_s: Floats
    stored_s: Floats
    schedule: tuple[Slot, ...] = ()
    in_flight_bit: Floats | None = None

    @property
    def hover_s(self) -> float:
        """Sum of the stored holds."""
        return round(float(self.stored_s.sum()), 6)

    @property
    def surplus_s(self) -> float:
        """What rounding up costs."""
        return self.hover_s - float(self.asked_s.sum())


def hold_times(
    scenario: Scenario,
    trajectory: Trajectory,
    rules: AutopilotRules,
    rates_bit_s_hz: Floats | None = None,
) -> Holds:
    """Return the hold at every stop for the scenario's service.

    Parameters
    ----------
    scenario, trajectory, rules
        What is asked, where, of which autopilot.
    rates_bit_s_hz
        (N, M) of every user at every stop over real ground, 0 out of reach; None: over a plane. With them nothing is
        counted in flight.

    Raises
    ------
    InputError
        A hold is longer than the autopilot can store.
    """
    channel = planning_channel(scenario)
    demand_bit = demand_on_air(scenario.users, trajectory)
    rates = None if rates_bit_s_hz is None else scenario.radio.bandwidth_hz * rates_bit_s_hz
    least_s = _pinned_s(scenario, trajectory, demand_bit, channel, rates)
    if scenario.service.mode == "tdma":
        holds = _tdma(scenario, trajectory, demand_bit, channel, rules, rates, least_s)
    else:
        in_flight_bit = None
        if rates is None and counts_in_flight(scenario):
            in_flight_bit = received_in_flight(
                scenario.users.xy_m, trajectory, channel, scenario.vehicle, rules
            )
            left_bit = demand_bit - in_flight_bit
            demand_bit = np.where(left_bit < DEMAND_TOLERANCE_BIT, 0.0, left_bit)
        near = near_rates(scenario.users, trajectory.stops_m, channel) if rates is None else sparse(rates)
        asked_s = least_s + _least_holds(near, np.maximum(demand_bit - near @ least_s, 0.0))
        stored_s = _stored_broadcast_holds(asked_s, near, demand_bit, rules, least_s)
        holds = Holds(asked_s, stored_s, in_flight_bit=in_flight_bit)
    too_long = np.flatnonzero(holds.stored_s > rules.max_hold_s)
    if len(too_long):
        raise InputError(
            Problem(
                f"stop {stop + 1}",
                f"needs a hold of {holds.stored_s[stop]:,.1f} s, {rules.title} stores at most "
                f"{rules.max_hold_s:,.0f} s: lower the demand, widen the bandwidth or use more clusters",
                "hold-too-long",
            )
            for stop in too_long
        )
    return holds


def _pinned_s(
    scenario: Scenario,
    trajectory: Trajectory,
    demand_bit: Floats,
    channel: Channel,
    rates_bit_s: Floats | None,
) -> Floats:
    """Return (M,) the least hold of each stop: what a pinned one is given, and what the user below it needs."""
    least_s = np.zeros(len(trajectory.stops_m))
    if not scenario.stops:
        return least_s
    names, stops_m = scenario.users.names, trajectory.stops_m
    for stop, pin in enumerate(pins_of(scenario).at(stops_m).tolist()):
        if pin == NO_PIN:
            continue
        pinned = scenario.stops[pin]
        least_s[stop] = pinned.hold_s
        user = names.index(pinned.user) if pinned.user in names else None
        if user is None or demand_bit[user] <= 0:
            continue
        away_m = np.linalg.norm(scenario.users.xy_m[user : user + 1] - stops_m[stop], axis=1)
        rate_bit_s = channel.radio.bandwidth_hz * float(channel.air_rate(away_m)[0])
        if rates_bit_s is not None:
            rate_bit_s = float(rates_bit_s[user, stop])
        if rate_bit_s > 0:
            least_s[stop] = max(least_s[stop], float(demand_bit[user]) / rate_bit_s)
    return least_s


def demand_on_air(users: Users, trajectory: Trajectory) -> Floats:
    """Return (N,) bits each user must receive from the vehicle: its own and its D2D mate's; 0 for a D2D user."""
    d2d = trajectory.assignment.d2d
    demand_bit = np.where(d2d, 0.0, users.demand_bit)
    demand_bit[users.mate[d2d]] += users.demand_bit[d2d]
    return demand_bit


def broadcast_rates(users: Users, stops_m: Floats, channel: Channel) -> Floats:
    """Return (N, M) bit/s of every user at every stop, 0 beyond R."""
    from scipy.spatial.distance import cdist

    distance_m = cdist(users.xy_m, stops_m)
    bit_s = channel.radio.bandwidth_hz * channel.air_rate(distance_m)
    return np.where(channel.reaches(distance_m), bit_s, 0.0)


def near_rates(users: Users, stops_m: Floats, channel: Channel) -> "csr_array":
    """Return the positive of `broadcast_rates` as sparse (N, M), columns in order: users reach few of many stops."""
    from scipy.sparse import csr_array
    from scipy.spatial import KDTree

    found: Any = KDTree(stops_m).query_ball_point(
        users.xy_m, channel.radius_m * (1 + WIDER) + WIDER, return_sorted=True
    )
    counts = np.array([len(stops) for stops in found], dtype=np.int64)
    stop: Ints = np.fromiter((at for stops in found for at in stops), np.int64, int(counts.sum()))
    user = np.repeat(np.arange(len(users)), counts)
    distance_m = np.linalg.norm(users.xy_m[user] - stops_m[stop], axis=1)
    kept = channel.reaches(distance_m)
    bit_s = channel.radio.bandwidth_hz * channel.air_rate(distance_m[kept])
    return csr_array((bit_s, (user[kept], stop[kept])), shape=(len(users), len(stops_m)))


def least_broadcast_holds(rates_bit_s: Floats, demand_bit: Floats) -> Floats:
    """Solve min Σ t_m subject to Σ_m r_nm·t_m ≥ D_n, t ≥ 0; of equally good answers the earliest stops.

    Parameters
    ----------
    rates_bit_s
        (N, M) rates.
    demand_bit
        (N,) demands; where one is positive, so must be one of its rates.

    Returns
    -------
    (M,) seconds.
    """
    return _least_holds(sparse(rates_bit_s), demand_bit)


def sparse(rates_bit_s: Floats) -> "csr_array":
    """Return the rates that are not 0."""
    from scipy.sparse import csr_array

    return csr_array(rates_bit_s)


def _least_holds(rates_bit_s: "csr_array", demand_bit: Floats) -> Floats:
    """Return what `least_broadcast_holds` does, of the rates that are not 0."""
    from scipy.sparse import csr_array, vstack

    stops = rates_bit_s.shape[1]
    wanting = np.flatnonzero(demand_bit > 0)
    if not len(wanting):
        return np.zeros(stops)
    # Each row divided by the user's best rate: the right-hand side is then the seconds that it needs at least, and
    # the solver's tolerance is one in seconds.
    needs, best_bit_s = _by_best(rates_bit_s[wanting])
    needs.data *= -1.0
    limits = -demand_bit[wanting] / best_bit_s
    shortest_s = _linear_programme(np.ones(stops), needs, limits)
    # A second programme settles ties: among all with this sum, the one whose seconds come earliest.
    with_sum = vstack([needs, csr_array(np.ones((1, stops)))])
    return _linear_programme(
        np.linspace(1.0 / stops, 1.0, stops), with_sum, np.append(limits, shortest_s.sum() * (1 + 1e-9))
    )


def _by_best(rates: "csr_array") -> tuple["csr_array", Floats]:
    """Return rows divided by their greatest entries, and those."""
    best: Floats = np.asarray(rates.max(axis=1).toarray(), dtype=np.float64).reshape(-1)
    divided = rates.copy()
    divided.data /= np.repeat(best, np.diff(divided.indptr))
    return divided, best


def _linear_programme(cost: Floats, matrix: Any, limits: Floats) -> Floats:
    """Return the x ≥ 0 of least cost with matrix·x ≤ limits, by HiGHS."""
    from scipy.optimize import linprog

    # SciPy takes sparse rows here; its stubs do not know it, nor that status 0 means a result.
    solve: Any = linprog
    found = solve(cost, A_ub=matrix, b_ub=limits, method="highs")
    if found.status != 0:
        raise ArithmeticError(f"hover programme: {found.message}")
    seconds: Floats = np.maximum(found.x, 0.0)
    return seconds


def _stored_broadcast_holds(
    asked_s: Floats, rates_bit_s: "csr_array", demand_bit: Floats, rules: AutopilotRules, least_s: Floats
) -> Floats:
    """Return whole steps that meet every demand and least hold: rounded up, or optimised where that is dear."""
    rounded = _topped_up(_rounded_up(asked_s, rules), rates_bit_s, demand_bit, rules)
    if rounded.sum() <= (1 + WORTHWHILE) * asked_s.sum():
        return rounded
    whole = _least_whole_steps(rates_bit_s, demand_bit, rules, least_s)
    if whole is None:
        return rounded
    whole = _topped_up(whole, rates_bit_s, demand_bit, rules)
    return whole if whole.sum() < rounded.sum() else rounded


def _rounded_up(asked_s: Floats, rules: AutopilotRules) -> Floats:
    """Return the least holds that the autopilot stores and that are not shorter; never less than its least."""
    # The solver's last digits must not cost a whole step; what they leave open `_topped_up` adds.
    steps = np.ceil((asked_s - ROUNDING_S) / rules.hold_step_s)
    return _seconds(np.maximum(steps, round(rules.min_hold_s / rules.hold_step_s)), rules)


def _seconds(steps: Floats, rules: AutopilotRules) -> Floats:
    """Return whole steps in seconds, as the nearest decimal: 83 steps of 0.1 s are 8.3 s."""
    return np.round(steps * rules.hold_step_s, 6)


def _topped_up(hold_s: Floats, rates_bit_s: "csr_array", demand_bit: Floats, rules: AutopilotRules) -> Floats:
    """Return the holds with steps added until what the autopilot stores (float32) meets every demand."""
    hold_s = hold_s.copy()
    short = rates_bit_s @ hold_s.astype(np.float32) < demand_bit - DEMAND_TOLERANCE_BIT
    for user in np.flatnonzero(short):
        own = slice(rates_bit_s.indptr[user], rates_bit_s.indptr[user + 1])
        stops, rates = rates_bit_s.indices[own], rates_bit_s.data[own]
        best = int(stops[rates.argmax()])
        while rates @ hold_s[stops].astype(np.float32) < demand_bit[user] - DEMAND_TOLERANCE_BIT:
            hold_s[best] = _seconds(hold_s[best : best + 1] / rules.hold_step_s + 1, rules)[0]
    return hold_s


def _least_whole_steps(
    rates_bit_s: "csr_array", demand_bit: Floats, rules: AutopilotRules, least_s: Floats
) -> Floats | None:
    """Return whole steps of least sum, or None where the bounded search finds none."""
    from scipy.optimize import Bounds, LinearConstraint, milp

    stops = rates_bit_s.shape[1]
    wanting = np.flatnonzero(demand_bit > 0)
    least = np.rint(_rounded_up(least_s, rules) / rules.hold_step_s)
    if not len(wanting):
        return _seconds(least, rules)
    needs, best_bit_s = _by_best(rates_bit_s[wanting])
    found = milp(
        np.ones(stops),
        constraints=LinearConstraint(needs, lb=demand_bit[wanting] / (best_bit_s * rules.hold_step_s)),
        integrality=np.ones(stops, dtype=np.int64),
        bounds=Bounds(lb=least),
        options={"node_limit": SEARCH_NODES, "mip_rel_gap": SEARCH_GAP},
    )
    return None if found.x is None else _seconds(np.rint(found.x), rules)


def _tdma(
    scenario: Scenario,
    trajectory: Trajectory,
    demand_bit: Floats,
    channel: Channel,
    rules: AutopilotRules,
    rates_bit_s: Floats | None,
    least_s: Floats,
) -> Holds:
    """Return holds and schedule where one user at a time is served, at its best stop, in the order of the file."""
    users, assignment = scenario.users, trajectory.assignment
    schedule: list[Slot] = []
    asked_s = np.zeros(len(trajectory.stops_m))
    for user in np.flatnonzero(demand_bit > 0):
        stop = int(assignment.stop[user])
        apart_m = np.linalg.norm(users.xy_m[user : user + 1] - trajectory.stops_m[stop], axis=1)
        rate_bit_s = channel.radio.bandwidth_hz * float(channel.air_rate(apart_m)[0])
        if rates_bit_s is not None:
            rate_bit_s = float(rates_bit_s[user, stop])
        duration_s = float(demand_bit[user]) / rate_bit_s
        schedule.append(Slot(stop, int(user), float(asked_s[stop]), duration_s))
        asked_s[stop] += duration_s
    asked_s = np.maximum(asked_s, least_s)
    stored_s = _rounded_up(asked_s, rules)
    # What float32 takes off is far below a bit's time, as in `_topped_up`.
    short = stored_s.astype(np.float32) < asked_s - ROUNDING_S
    stored_s[short] = _seconds(stored_s[short] / rules.hold_step_s + 1, rules)
    return Holds(asked_s, stored_s, tuple(schedule))
