"""A track from CSV, for every log that mavplan does not read: a header, then a position a line.

Columns: ``time_s`` (seconds of one clock), ``lat_deg``, ``lon_deg``, ``alt_rel_m`` (above home); where they are
known also ``armed`` (0 or 1) and ``reached`` (the mission item that was reached at this moment, as
MISSION_ITEM_REACHED numbers it; else empty). Others are not read. Comma, semicolon or tab.
"""

import math
from dataclasses import replace

from mavplan.errors import InputError, Problem
from mavplan.scenario.report import Report
from mavplan.scenario.table import Table
from mavplan.scenario.users_csv import read_csv
from mavplan.track.model import Track
from mavplan.track.runs import CLOCK_SLIP_S, Run, flight_track

COLUMNS = ("time_s", "lat_deg", "lon_deg", "alt_rel_m")
"""What a line must have."""


def read_track_csv(data: bytes, label: str) -> Track:
    """Return the track in a CSV file.

    Raises
    ------
    InputError
        It is no CSV with these columns, or no line is good. Lines that are not are left out, and told.
    """
    report = Report()
    table = read_csv(data.decode("utf-8-sig", "replace"), label, report)
    if table is None:
        raise InputError(report.problems())
    missing = [name for name in COLUMNS if name not in table.columns]
    if missing:
        message = f"has no column {', '.join(missing)}; a track needs {', '.join(COLUMNS)}"
        raise InputError([Problem(label, message, "missing-column")])
    # A line that is cut or has too many cells is left out, as a log's damage is.
    notes = [replace(problem, severity="warning") for problem in report.problems()]
    runs, bad = _runs(table)
    if bad:
        message = f"{len(bad):,} lines hold no position in numbers (the first is line {bad[0]:,})"
        notes.append(Problem(label, f"{message} and are left out", "bad-lines", "warning"))
    return flight_track(runs, label, notes)


def _runs(table: Table) -> tuple[list[Run], list[int]]:
    """Return the runs of the clock, and the lines without a position."""
    runs, bad = [Run()], []
    newest_s = -math.inf
    for row in table.rows:
        cells = {name: row.cells.get(name) for name in (*COLUMNS, "armed", "reached")}
        values = [_number(cells[name]) for name in COLUMNS]
        if any(value is None for value in values):
            bad.append(row.number)
            continue
        time_s, lat_deg, lon_deg, alt_rel_m = (value or 0.0 for value in values)
        if time_s < newest_s - CLOCK_SLIP_S:
            runs.append(Run())
            newest_s = time_s
        newest_s = max(newest_s, time_s)
        runs[-1].positions.append((time_s, lat_deg, lon_deg, alt_rel_m))
        if (armed := _number(cells["armed"])) is not None:
            runs[-1].armed.append((time_s, armed != 0))
        if (reached := _number(cells["reached"])) is not None and 0 <= reached <= 65_535:
            runs[-1].reached.append((time_s, int(reached)))
    return runs, bad


def _number(cell: object) -> float | None:
    """Return a finite number, None where there is none."""
    try:
        value = float(str(cell))
    except ValueError:
        return None
    return value if math.isfinite(value) else None
