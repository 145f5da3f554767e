"""The files that a plan is written to, by their suffix; all are prepared before any is replaced."""

import functools
from collections.abc import Sequence
from pathlib import Path

from mavplan.cli.streams import STEM, is_stdout, write_outputs_of
from mavplan.errors import InputError, Problem
from mavplan.figures.files import PICTURES, check_picture, draw_plan, plan_names
from mavplan.formats import FORMATS, format_of
from mavplan.formats.atomic import no_folder
from mavplan.formats.beside import plan_path
from mavplan.maps import MAPS, plan_map
from mavplan.plan import Plan
from mavplan.plan_file import dumps
from mavplan.progress import Progress
from mavplan.stored_plan import parse_plan


def check_outputs(paths: Sequence[Path]) -> None:
    """Raise an `InputError` for every path whose suffix says no format, before any work is done."""
    check_suffixes(paths, (*FORMATS, *MAPS, *PICTURES))
    nowhere = [path for path in paths if not is_stdout(path) and not path.parent.is_dir()]
    if nowhere:
        raise InputError(no_folder(path) for path in nowhere)
    for path in paths:
        if path.suffix.lower() in PICTURES:
            check_picture(path)


def check_suffixes(paths: Sequence[Path], known: Sequence[str]) -> None:
    """Raise an `InputError` for every path whose suffix is not one of these."""
    problems = [
        Problem(
            str(path),
            f"{path.suffix or 'a name without suffix'} is no output format: {', '.join(known)}",
            "format",
        )
        for path in paths
        if path.suffix.lower() not in known
    ]
    if problems:
        raise InputError(problems)


def write_outputs(
    plan: Plan, paths: Sequence[Path], progress: Progress | None = None
) -> tuple[list[Path], list[Problem]]:
    """Write each file, and the plan itself beside each mission file; ``progress`` tells of a proof in it.

    Returns
    -------
    The files in the order in which they were asked for, and warnings of the formats and pictures.
    """
    contents, warnings = prepared(plan, paths, progress)
    write_outputs_of(contents.items())
    warnings += picture_warnings([plan], paths)
    return [path for path in contents if not is_stdout(path)], warnings


def picture_warnings(plans: Sequence[Plan], paths: Sequence[Path]) -> tuple[Problem, ...]:
    """Return one warning of the names that no font here can draw, where a picture is among the files."""
    drawn = any(path.suffix.lower() in PICTURES for path in paths)
    return plan_names(plan.scenario for plan in plans) if drawn else ()


def prepared(
    plan: Plan, paths: Sequence[Path], progress: Progress | None = None
) -> tuple[dict[Path, str | bytes], list[Problem]]:
    """Return what each file will hold, the plan itself beside each mission file too, and warnings of the formats."""
    contents: dict[Path, str | bytes] = {}
    warnings: list[Problem] = []
    plan_text = functools.cache(lambda: dumps(plan, progress))  # a proof in it takes a while
    for path in paths:
        if path.suffix.lower() in PICTURES:
            contents[path] = draw_plan(plan, path)
            continue
        if path.suffix.lower() in MAPS:
            stored = parse_plan(plan_text(), str(path))
            contents[path] = MAPS[path.suffix.lower()](
                plan_map(plan.built.mission, stored, STEM if is_stdout(path) else path.stem)
            )
            continue
        mission_format = format_of(path)
        contents[path] = mission_format.dumps(plan.built.mission)
        warnings += [
            Problem(str(path), problem.message, problem.code, problem.severity)
            for problem in mission_format.warnings(plan.built.mission)
        ]
        if not is_stdout(path):
            contents.setdefault(plan_path(path), plan_text())
    return contents, warnings
