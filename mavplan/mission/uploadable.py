"""Everything of a mission that goes to a vehicle: its lists in the order in which they are sent, and what is wrong.

A fence and rally points go before the mission, so that a vehicle that refuses them keeps its old mission. A list that
the mission does not have is not sent, and the vehicle keeps the one it has.
"""

from mavplan.errors import InputError, Problem
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.fence_wire import fence_problems, fence_to_wire, rally_to_wire
from mavplan.mission.model import Mission
from mavplan.mission.sendable import wire_problems
from mavplan.mission.wire import WireItem, to_wire

MISSION_TYPE, FENCE_TYPE, RALLY_TYPE = 0, 1, 2
"""MAV_MISSION_TYPE."""


def lists_to_send(mission: Mission, rules: AutopilotRules) -> dict[int, tuple[WireItem, ...]]:
    """Return the items of each list that is sent, by MAV_MISSION_TYPE, in the order of sending: the mission last.

    Raises
    ------
    Nothing: call `check_uploadable` first.
    """
    lists = {FENCE_TYPE: fence_to_wire(mission, rules), RALLY_TYPE: rally_to_wire(mission, rules)}
    return {kind: items for kind, items in lists.items() if items} | {MISSION_TYPE: to_wire(mission, rules)}


def item_count(mission: Mission) -> int:
    """Return how many items go to the vehicle in all, home not counted."""
    fence = mission.fence
    areas = sum(len(area.vertices_e7) for area in fence.polygons) + len(fence.circles) if fence else 0
    return len(mission.items) + areas + len(mission.rally)


def check_uploadable(mission: Mission, rules: AutopilotRules, source: str = "") -> tuple[Problem, ...]:
    """Return the warnings about a mission, its fence and its rally points; raise what must not be sent.

    Parameters
    ----------
    mission, rules
        As for `lists_to_send`.
    source
        The file that the mission is from, named in front of every problem.

    Raises
    ------
    InputError
        All problems of all lists at once.
    """
    at = f"{source}, " if source else ""
    problems = [
        Problem(f"{at}{problem.where}", problem.message, problem.code, problem.severity)
        for problem in (*wire_problems(mission, rules), *fence_problems(mission, rules))
    ]
    if errors := [problem for problem in problems if problem.severity == "error"]:
        raise InputError(errors)
    return tuple(problems)
