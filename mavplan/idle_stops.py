"""Stops at which nobody is served: a mission leaves them out.

The paper's planners keep every stop of their clusters, also one whose users are all nearer to another. Studies count
them as published; an aircraft would fly there for nothing. Pure.
"""

from dataclasses import replace

import numpy as np

from mavplan.hover import hold_times
from mavplan.inflight import counts_in_flight
from mavplan.mission.autopilots import AutopilotRules
from mavplan.planners.pinned import NO_PIN, pins_of
from mavplan.planners.trajectory import NO_STOP, Trajectory
from mavplan.scenario.model import Scenario


def without_idle_stops(scenario: Scenario, trajectory: Trajectory, rules: AutopilotRules) -> Trajectory:
    """Return a trajectory without the stops that are nobody's and at which nothing is held for.

    The path gets no longer by it and nobody's stop or link another one. All stops stay where users receive in flight
    and in the benchmark; a pinned one always. Over real ground, users that a hill then hides get stops of their own.

    Raises
    ------
    InputError
        A hold is longer than the autopilot can store.
    """
    if counts_in_flight(scenario) or trajectory.planner == "sbw":
        return trajectory
    served = trajectory.assignment.stop
    idle = pins_of(scenario).at(trajectory.stops_m) == NO_PIN
    idle[served[served != NO_STOP]] = False
    if not idle.any():
        return trajectory
    idle &= hold_times(scenario, trajectory, rules).asked_s <= 0.0
    kept = ~idle
    rows = np.ones(len(trajectory.path_m), dtype=bool)
    rows[trajectory.stop_at[idle]] = False
    number = np.cumsum(kept) - 1
    stop = np.where(served == NO_STOP, NO_STOP, number[served])
    return replace(
        trajectory,
        path_m=trajectory.path_m[rows],
        stop_at=(np.cumsum(rows) - 1)[trajectory.stop_at[kept]],
        assignment=replace(trajectory.assignment, stop=stop),
    )
