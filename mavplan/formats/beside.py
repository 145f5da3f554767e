"""The plan beside a mission file, ``X.mavplan.json``: where it is, and what the mission file does not say.

Light, so that an upload can ask it; what is in the plan is written by `mavplan.plan_file`. After a verified upload its
key ``vehicle`` says which vehicle holds it: ``autopilot``, ``system``, ``opaque_id`` (PX4's id of the mission) and
``verified_at`` (UTC).
"""

import dataclasses
import json
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mavplan.errors import InputError, Problem
from mavplan.formats import FORMATS, read_mission
from mavplan.formats.atomic import atomic_write
from mavplan.json_layout import laid_out
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.model import Autopilot, Mission

if TYPE_CHECKING:
    from mavplan.link.report import UploadReport

SUFFIX = ".mavplan.json"

MAX_HOME_HEIGHT_M, MAX_HOME_HEIGHT_OVER_GROUND_M = 30.0, 10.0


def plan_path(mission_file: Path) -> Path:
    """Return where the plan of a mission file is: ``out/valley.plan`` → ``out/valley.mavplan.json``."""
    return mission_file.with_name(mission_file.stem + SUFFIX)


def mission_beside(plan_file: Path) -> Path:
    """Return the mission of a plan: ``valley.mavplan.json`` → ``valley.plan``, or ``.waypoints`` if only that is there.

    Raises
    ------
    InputError
        There is none.
    """
    stem = plan_file.name.removesuffix(SUFFIX)
    found = [plan_file.with_name(stem + suffix) for suffix in FORMATS]
    there = [path for path in found if path.is_file()]
    if not there:
        message = f"there is no mission beside it: {' or '.join(path.name for path in found)}"
        raise InputError([Problem(str(plan_file), message, "no-mission")])
    return there[0]


def read_known_mission(path: Path, autopilot: Autopilot | None = None) -> Mission:
    """Return the mission in a file, its autopilot taken from the plan beside it where the file does not say.

    Parameters
    ----------
    path
        A ``.plan`` or ``.waypoints`` file.
    autopilot
        What the user says it is for.

    Raises
    ------
    InputError
        The file cannot be read, or it is for another autopilot than the user says.
    """
    mission = read_mission(path)
    known = mission.autopilot or _planned_autopilot(plan_path(path))
    if autopilot and known and autopilot != known:
        message = f"is for {AUTOPILOTS[known].title}, not for {AUTOPILOTS[autopilot].title}: plan again for that one"
        raise InputError([Problem(str(path), message, "other-autopilot")])
    return dataclasses.replace(mission, autopilot=autopilot or known)


def home_height_limit_m(mission_file: Path, asked_m: float | None = None) -> float:
    """Return how much higher or lower than the mission's a vehicle's home may be.

    What was asked for; else 10 m where the plan beside the mission file keeps clear of terrain, and 30 m elsewhere.
    """
    if asked_m is not None:
        return asked_m
    scenario = _content(plan_path(mission_file)).get("scenario")
    terrain = scenario.get("terrain") if isinstance(scenario, dict) else None
    over_ground = isinstance(terrain, dict) and bool(terrain.get("file"))
    return MAX_HOME_HEIGHT_OVER_GROUND_M if over_ground else MAX_HOME_HEIGHT_M


def _planned_autopilot(path: Path) -> Autopilot | None:
    """Return the autopilot a plan was made for, None where there is no readable plan."""
    found = _content(path).get("autopilot")
    return next((name for name in AUTOPILOTS if name == found), None)


def _content(path: Path) -> dict[str, Any]:
    """Return what a plan holds; empty where there is no readable one."""
    try:
        content = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def remember_vehicle(mission_file: Path, report: "UploadReport") -> tuple[Problem, ...]:
    """Write into the plan beside a mission file which vehicle holds it now; nothing where there is no plan.

    Parameters
    ----------
    mission_file
        What was uploaded.
    report
        How that went.

    Returns
    -------
    tuple of Problem
        A warning where the plan could not be written: the vehicle holds the mission all the same.
    """
    path = plan_path(mission_file)
    content = _content(path)
    if not content:
        return ()
    content["vehicle"] = {
        "autopilot": report.autopilot,
        "system": report.vehicle.system,
        "opaque_id": report.opaque_id,
        "verified_at": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    try:
        # Half a character is JSON only as an escape.
        atomic_write(path, laid_out(content, allow_nan=True).encode("utf-8", "backslashreplace"))
    except InputError as error:
        return tuple(Problem(found.where, found.message, found.code, "warning") for found in error.problems)
    return ()


def remembered_vehicle(mission_file: Path) -> dict[str, object]:
    """Return what `remember_vehicle` wrote last; empty where there is nothing to be read."""
    found = _content(plan_path(mission_file)).get("vehicle")
    return found if isinstance(found, dict) else {}
