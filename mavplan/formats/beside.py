"""The plan beside a mission file, ``X.mavplan.json``: where it is, and what the mission file does not say.

Light, so that an upload can ask it; what is in the plan is written by `mavplan.plan_file`.
"""

import dataclasses
import json
from pathlib import Path

from mavplan.errors import InputError, Problem
from mavplan.formats import read_mission
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.model import Autopilot, Mission

SUFFIX = ".mavplan.json"


def plan_path(mission_file: Path) -> Path:
    """Return where the plan of a mission file is: ``out/valley.plan`` → ``out/valley.mavplan.json``."""
    return mission_file.with_name(mission_file.stem + SUFFIX)


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


def _planned_autopilot(path: Path) -> Autopilot | None:
    """Return the autopilot a plan was made for, None where there is no readable plan."""
    try:
        content = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError):
        return None
    found = content.get("autopilot") if isinstance(content, dict) else None
    return found if found in AUTOPILOTS else None
