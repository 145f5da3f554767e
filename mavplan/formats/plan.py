"""QGroundControl's ``.plan``: a `Mission` as JSON and back.

Field by field in docs/mission-files.md. The format: https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html;
where that page and the programs differ, this follows the programs (QGroundControl, MAVSDK, Mission Planner).
Reading is in `mavplan.formats.plan_reader`; what items may hold stands in `mavplan.formats.values`; fence and rally
points, both ways, in `mavplan.formats.plan_areas`.
"""

import json
import math
from typing import Any

from mavplan.errors import InputError, Problem
from mavplan.formats import plan_areas, values
from mavplan.formats.plan_reader import PlanReader
from mavplan.formats.values import mission_problems, normal_item
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.model import Command, Frame, Mission, MissionItem

ALTITUDE_MODE = {Frame.GLOBAL_RELATIVE_ALT: 1, Frame.GLOBAL: 2, Frame.GLOBAL_TERRAIN_ALT: 4}
"""QGroundControl's name for each frame; 0 is a mixture of them, in a whole plan only."""


def dumps(mission: Mission) -> str:
    """Return a mission as the text of a ``.plan`` file.

    Parameters
    ----------
    mission
        Frames of equal meaning are written as ground stations write them (6 as 3, 5 as 0).

    Raises
    ------
    InputError
        An item, home, a fence area or a rally point cannot stand in the file; all problems at once.
    """
    problems = tuple(mission_problems(mission))
    if problems:
        raise InputError(problems)
    items = tuple(normal_item(item) for item in mission.items)
    modes = {ALTITUDE_MODE[Frame(item.frame)] for item in items if item.has_position}
    home = mission.home
    document = {
        "fileType": "Plan",
        "geoFence": plan_areas.fence_section(mission.fence),
        "groundStation": "mavplan",
        "mission": {
            "cruiseSpeed": _whole(mission.cruise_speed_m_s),
            "firmwareType": AUTOPILOTS[mission.autopilot].mav_autopilot if mission.autopilot else 0,
            "globalPlanAltitudeMode": modes.pop() if len(modes) == 1 else 0,
            "hoverSpeed": _whole(mission.hover_speed_m_s),
            "items": [_item(index, item) for index, item in enumerate(items)],
            "plannedHomePosition": [
                home.lat_e7 / 1e7,
                home.lon_e7 / 1e7,
                values.json_number(home.alt_amsl_m),
            ],
            "vehicleType": mission.mav_type,
            "version": 2,
        },
        "rallyPoints": plan_areas.rally_section(mission.rally),
        "version": 1,
    }
    return json.dumps(document, indent=4, allow_nan=False) + "\n"


def loads(text: str, name: str) -> Mission:
    """Return the mission in the text of a ``.plan`` file.

    Parameters
    ----------
    text
        The whole file.
    name
        What messages call it, usually its path.

    Returns
    -------
    Mission
        ``autopilot`` is None where the file says generic firmware. ``warnings`` tells what was left out: a fence's
        return point, which multirotors do not use.

    Raises
    ------
    InputError
        Every problem that was found, each with its place, for instance ``mission.items[3].params[4]``.
    """
    return PlanReader(name).read(text)


def warnings(mission: Mission) -> tuple[Problem, ...]:
    """Return what this format cannot say as it is meant: nothing."""
    del mission
    return ()


def _item(index: int, item: MissionItem) -> dict[str, Any]:
    params: list[float | int | None] = [values.json_number(value) for value in item.params]
    if item.command == Command.DO_JUMP:
        params[0] = int(item.params[0]) + 1  # the doJumpId of the target
    entry: dict[str, Any] = {}
    if item.has_position:
        altitude = values.json_number(item.alt_m)
        entry = {
            "AMSLAltAboveTerrain": None,  # QGroundControl's own "not known yet": it has the terrain, we have not
            "Altitude": altitude,
            "AltitudeMode": ALTITUDE_MODE[Frame(item.frame)],
        }
        params += [item.lat_deg, item.lon_deg, altitude]
    else:
        params += [0, 0, 0]
    return entry | {
        "autoContinue": item.autocontinue,
        "command": int(item.command),
        "doJumpId": index + 1,
        "frame": int(item.frame),
        "params": params,
        "type": "SimpleItem",
    }


def _whole(speed_m_s: float) -> int:
    """Return a speed for display; Mission Planner parses it as an integer. The vehicle obeys DO_CHANGE_SPEED."""
    return max(1, round(speed_m_s)) if math.isfinite(speed_m_s) else 1
