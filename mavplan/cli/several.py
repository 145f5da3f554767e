"""``mavplan plan`` for several flights: a row and files for each, the sums, and what is left over."""

import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from mavplan.cli.console import (
    answer,
    clock,
    counted,
    plain_table,
    print_table,
    printable,
    progress,
    say_problems,
    stopwatch,
    tell,
    tell_next,
    tell_written,
)
from mavplan.cli.outputs import picture_warnings, prepared
from mavplan.cli.streams import is_stdout
from mavplan.cli.tables import altitude_line, print_items, print_plan
from mavplan.errors import InputError, Problem
from mavplan.fleet.make import longest_s
from mavplan.formats import FORMATS
from mavplan.formats.atomic import write_all
from mavplan.plan import Plan
from mavplan.plan_file import summary
from mavplan.scenario.model import Scenario
from mavplan.scenario.write import scenario_toml, users_csv

MOST_NAMES = 12
"""Names of users in one line; the rest is counted."""


def fly_sorties(
    scenario: Scenario,
    hover: str,
    count: int | str,
    outputs: Sequence[Path],
    *,
    items: bool,
) -> None:
    """Plan sorties, write their files and print a row for each."""
    from mavplan.sorties.make import plan_sorties

    check_not_stdout(outputs)
    with progress("planning") as move:
        made = plan_sorties(scenario, hover, count if isinstance(count, int) else None, move)  # type: ignore[arg-type]
    suffixes = _numbers(made.plans)
    rest = {} if made.rest is None else rest_files(made.rest, outputs[0])
    written, warnings = _write(made.plans, suffixes, outputs, rest)
    names = [_named(outputs[0], suffix) for suffix in suffixes]
    say_problems([*_warnings(made.plans, names), *warnings, *_left_out(made.not_served)])
    if len(made.plans) == 1:
        print_plan(made.plans[0])
        if made.rest is None:
            tell("one sortie is enough")
    else:
        print_flights("sortie", made.plans, names)
        air = sum(plan.forecast.mission_s for plan in made.plans)
        tell(f"{counted(len(made.plans), 'sortie')}: {clock(air)} in the air, batteries changed in between")
    _print_items(made.plans, suffixes, items=items)
    _tell_left_out(scenario, made.not_served)
    tell_written(written)
    answer(
        _answer(made.plans, suffixes, outputs, made.not_served) | {"written": [str(path) for path in written]}
    )
    _tell_report(names)


def _left_out(names: Sequence[str]) -> list[Problem]:
    """Return the warning that some users are not served, if some are."""
    if not names:
        return []
    message = f"{_shortened(names)}: what the battery gives goes to others"
    return [Problem("not served", message, "not-served", "warning")]


def _tell_left_out(scenario: Scenario, names: Sequence[str]) -> None:
    """Tell how much is not served, if something is not."""
    if not names:
        return
    users = scenario.users
    value, lost = float(users.weighted_bit.sum()), float(users.weighted_bit[users.named(names)].sum())
    tell(
        f"not served: {counted(len(names), 'user')} ({_shortened(names)}), "
        f"{lost / value if value else 0:.0%} of the weighted demand"
    )


def fly_fleet(
    scenario: Scenario,
    hover: str,
    count: int,
    outputs: Sequence[Path],
    apart_m: tuple[float, float],
    *,
    sorties: int | str | None,
    items: bool,
) -> None:
    """Plan a fleet, write its files and print a row for each vehicle.

    Parameters
    ----------
    apart_m
        Separation over the ground, and the step between heights.
    sorties
        Into how many each vehicle's flight is cut at most where a battery ends; any word: as many as it takes; None: it
        is not cut.
    """
    from mavplan.fleet.make import plan_fleet

    check_not_stdout(outputs)
    with progress("planning") as move:
        made = plan_fleet(
            scenario,
            count,
            hover,  # type: ignore[arg-type]
            separation_m=apart_m[0],
            altitude_step_m=apart_m[1],
            sorties=sorties is not None,
            most=sorties if isinstance(sorties, int) else None,
            progress=move,
        )
    suffixes = _numbers(made.plans)
    rest = {} if made.rest is None else rest_files(made.rest, outputs[0])
    written, warnings = _write(made.plans, suffixes, outputs, rest)
    names = [_named(outputs[0], suffix) for suffix in suffixes]
    say_problems([*_warnings(made.plans, names), *warnings, *made.said, *_left_out(made.not_served)])
    print_flights("vehicle", made.plans, names)
    rounds = max(1 if plan.part is None else plan.part.round for plan in made.plans)
    flying = len({1 if plan.part is None else plan.part.number for plan in made.plans})
    who = counted(flying, "vehicle")
    if rounds > 1:
        who += f", {counted(len(made.plans), 'sortie')} in {counted(rounds, 'round')}"
    one = f" ({clock(made.single_s)} with one vehicle)" if math.isfinite(made.single_s) else ""
    changed = ", batteries changed between the rounds" if rounds > 1 else ""
    tell(
        f"{who}: done {clock(made.longest_s)} after the first start{one}, "
        f"{clock(sum(plan.forecast.mission_s for plan in made.plans))} in the air{changed}"
    )
    _print_items(made.plans, suffixes, items=items)
    _tell_left_out(scenario, made.not_served)
    tell_written(written)
    answer(
        _answer(made.plans, suffixes, outputs, made.not_served) | {"written": [str(path) for path in written]}
    )
    _tell_report(names)


def _tell_report(names: Sequence[Path]) -> None:
    """Tell how all flights are looked at together, where these files are missions."""
    if names[0].suffix.lower() in FORMATS:
        tell_next("mavplan", "report", *names, why="as one page to look at")


def print_flights(kind: str, plans: Sequence[Plan], files: Sequence[Path]) -> None:
    """Print a row for each flight."""
    known = all(plan.forecast.used_wh is not None for plan in plans)
    charged = known and all(plan.remaining_fraction is not None for plan in plans)
    first = plans[0]
    table = plain_table(f"{first.trajectory.planner.upper()} for {first.rules.title}")
    fleet = kind == "vehicle"
    table.add_column(kind)
    rounds = fleet and any(plan.part is not None and plan.part.rounds > 1 for plan in plans)
    for heading in (*(["round"] if rounds else []), "starts", "height m") if fleet else ():
        table.add_column(heading, justify="right", no_wrap=True)
    for heading in ("stops", "users", "path m", "hover", "mission"):
        table.add_column(heading, justify="right", no_wrap=True)
    for heading in (*(["Wh"] if known else []), *(["left"] if charged else [])):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("file")
    if plans[0].altitude is not None:
        tell(altitude_line(plans[0].altitude))
    for number, (plan, file) in enumerate(zip(plans, files, strict=True), start=1):
        part = plan.part
        cells = [str(number)]
        if part is not None and fleet:
            cells = [printable(part.name) or str(part.number), *([str(part.round)] if rounds else [])]
        if fleet:
            cells += [
                stopwatch(0.0 if part is None else part.start_s),
                f"{plan.scenario.vehicle.altitude_m:g}",
            ]
        cells += [
            str(len(plan.built.stop_items)),
            str(len(plan.scenario.users)),
            f"{plan.trajectory.length_m:,.0f}",
            clock(plan.holds.hover_s),
            clock(plan.forecast.mission_s),
        ]
        cells += [f"{plan.forecast.used_wh:,.1f}"] if known else []
        cells += [f"{plan.remaining_fraction:.0%}"] if charged else []
        table.add_row(*cells, printable(str(file)))
    print_table(table)
    tell()


def rest_files(rest: Scenario, output: Path) -> dict[Path, str | bytes]:
    """Return a scenario of the users that are left over, beside the first file that is written."""
    scenario = output.with_name(f"{output.stem}-rest.toml")
    users = scenario.with_suffix(".csv")
    remark = printable(
        f"The users that {output.name} leaves over, with what they need.\n\n  mavplan plan {scenario.name}"
    )
    return {scenario: scenario_toml(rest, users.name, remark), users: users_csv(rest.users)}


def _numbers(plans: Sequence[Plan]) -> list[str]:
    """Return what follows the name of each flight's files: nothing where there is only one.

    ``-2`` for the second, ``-2-1`` for the second vehicle in the first round of sorties.
    """
    if any(plan.part is not None and plan.part.rounds > 1 for plan in plans):
        return [f"-{plan.part.number}-{plan.part.round}" for plan in plans if plan.part is not None]
    return [""] if len(plans) == 1 else [f"-{number}" for number in range(1, len(plans) + 1)]


def _warnings(plans: Sequence[Plan], names: Sequence[Path]) -> list[Problem]:
    """Return what is to be known of all flights once, and what of some with the name of the flight's file."""
    common = [warning for warning in plans[0].warnings if all(warning in plan.warnings for plan in plans)]
    if len(plans) == 1:
        return common
    own = [
        replace(warning, where=f"{name}, {warning.where}")
        for plan, name in zip(plans, names, strict=True)
        for warning in plan.warnings
        if warning not in common
    ]
    return [*common, *own]


def _named(path: Path, suffix: str) -> Path:
    """Return ``valley-1.plan`` for ``valley.plan``."""
    return path.with_name(f"{path.stem}{suffix}{path.suffix}")


def _write(
    plans: Sequence[Plan],
    suffixes: Sequence[str],
    outputs: Sequence[Path],
    others: dict[Path, str | bytes],
) -> tuple[list[Path], list[Problem]]:
    """Write the files of every flight, all or none."""
    contents: dict[Path, str | bytes] = {}
    warnings: list[Problem] = []
    for plan, suffix in zip(plans, suffixes, strict=True):
        files, noticed = prepared(plan, [_named(path, suffix) for path in outputs])
        contents |= files
        warnings += noticed
    contents |= others
    write_all(contents.items())
    warnings += picture_warnings(plans, outputs)
    return list(contents), warnings


def check_not_stdout(outputs: Sequence[Path]) -> None:
    """Raise an `InputError` where standard output is to take the files of several flights."""
    if any(is_stdout(path) for path in outputs):
        raise InputError("-o -: standard output takes one file, several flights have one each; name a file")


def _answer(
    plans: Sequence[Plan], suffixes: Sequence[str], outputs: Sequence[Path], not_served: Sequence[str]
) -> dict[str, Any]:
    """Return the one object for scripts."""
    return {
        "flights": [
            {
                "files": [str(_named(path, suffix)) for path in outputs],
                "part": None if plan.part is None else asdict(plan.part),
                **summary(plan),
            }
            for plan, suffix in zip(plans, suffixes, strict=True)
        ],
        "not_served": list(not_served),
        "mission_s": round(sum(plan.forecast.mission_s for plan in plans), 2),
        "longest_s": round(longest_s(plans), 2),
    }


def _print_items(plans: Sequence[Plan], suffixes: Sequence[str], *, items: bool) -> None:
    for plan, suffix in zip(plans, suffixes, strict=True) if items else ():
        tell()
        if suffix:
            tell(f"{suffix.removeprefix('-')}:")
        print_items(plan)
        tell()


def _shortened(names: Sequence[str]) -> str:
    shown = ", ".join(printable(name).replace("\n", " ") for name in names[:MOST_NAMES])
    return f"{shown} and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else shown
