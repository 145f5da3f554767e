"""The folder that a study lives in: what it varies, and every row found so far. Killed at any moment, it goes on.

``study.json`` names the settings; it is replaced whole. ``cases.jsonl`` holds a row a line and is only ever appended
to, each batch flushed to disk. What a kill tore off is cut away when the folder is next opened, and run again.
"""

import dataclasses
import fcntl
import json
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mavplan.errors import InputError, Problem
from mavplan.formats.atomic import atomic_write
from mavplan.study.cases import Case, Row
from mavplan.study.regime import stand_ins
from mavplan.study.settings import Settings
from mavplan.workers.versions import versions

SETTINGS_FILE = "study.json"
ROWS_FILE = "cases.jsonl"
FORMAT = 1

Key = tuple[Case, str]
"""A case and a planner: what a row is of."""

_CASE_FIELDS = tuple(field.name for field in dataclasses.fields(Case))
_ROW_FIELDS = tuple(field.name for field in dataclasses.fields(Row) if field.name != "case")
COLUMNS = (*_CASE_FIELDS, *_ROW_FIELDS)
"""Names of a row's values, in the order of a line."""


def row_values(row: Row) -> dict[str, Any]:
    """Return a row as one flat table: the values of its case, then its own."""
    values = {name: getattr(row.case, name) for name in _CASE_FIELDS}
    return values | {name: getattr(row, name) for name in _ROW_FIELDS}


class Store:
    """An open study folder; `open_store` makes one.

    Attributes
    ----------
    rows
        Every row there is.
    warnings
        What was noticed on opening.
    """

    def __init__(
        self, path: Path, descriptor: int, rows: dict[Key, Row], warnings: tuple[Problem, ...]
    ) -> None:
        self.rows = rows
        self.warnings = warnings
        self._path = path
        self._descriptor = descriptor

    def append(self, rows: Iterable[Row]) -> None:
        """Write rows to disk; they are there for good when this returns.

        Raises
        ------
        InputError
            The disk does not take them.
        """
        rows = list(rows)
        lines = b"".join(_line(row) for row in rows)
        try:
            while lines:
                lines = lines[os.write(self._descriptor, lines) :]
            os.fsync(self._descriptor)
        except OSError as error:
            message = f"cannot be written: {error.strerror}; what was finished before is kept"
            raise InputError([Problem(str(self._path), message, "not-writable")]) from error
        self.rows.update({(row.case, row.planner): row for row in rows})


@contextmanager
def open_store(folder: Path, settings: Settings) -> Iterator[Store]:
    """Open a study folder, or make it, for one process at a time.

    Parameters
    ----------
    folder
        Made where it is missing; its parent must be there.
    settings
        Those the folder was made with, or more: an extension is written to ``study.json``.

    Raises
    ------
    InputError
        The folder holds another study, is being written to by another process, or cannot be read or written.
    """
    rows_path = folder / ROWS_FILE
    try:
        folder.mkdir(exist_ok=True)
        descriptor = os.open(rows_path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
    except OSError as error:
        message = f"cannot be used as the folder of a study: {error.strerror}"
        raise InputError([Problem(str(folder), message, "not-writable")]) from error
    try:
        try:
            # Gone with the process, however it ends.
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            message = "another process is at work in this study; wait for it, or choose another folder"
            raise InputError([Problem(str(folder), message, "in-use")]) from error
        content = rows_path.read_bytes()
        warnings = _settle(folder, settings, begun=bool(content))
        rows, good_bytes = _read_rows(rows_path, content, settings)
        if good_bytes < len(content):
            os.ftruncate(descriptor, good_bytes)
            os.fsync(descriptor)
        yield Store(rows_path, descriptor, rows, warnings)
    finally:
        os.close(descriptor)


def read_settings(folder: Path) -> Settings | None:
    """Return the settings of the study in a folder; None where there is no study.

    Raises
    ------
    InputError
        ``study.json`` cannot be read.
    """
    found = _read_settings_file(folder)
    return None if found is None else found[0]


def _settle(folder: Path, settings: Settings, *, begun: bool) -> tuple[Problem, ...]:
    """Hold the settings to those of the folder and write them down; return what is worth telling."""
    path = folder / SETTINGS_FILE
    found = _read_settings_file(folder)
    warnings: tuple[Problem, ...] = ()
    made_with = versions()
    if found is None:
        if begun:
            message = f"holds rows, but no {SETTINGS_FILE} says of which study; choose another folder"
            raise InputError([Problem(str(folder / ROWS_FILE), message, "no-settings")])
    else:
        older, rest = found
        problems = settings.not_extending(older)
        if rest["stand_ins"] != stand_ins():
            message = "its regime has other numbers than this version of mavplan; choose another folder"
            problems.append(Problem("stand_ins", message, "other-study"))
        if rest["versions"].get("code") != made_with["code"]:
            message = (
                f"its rows are of another state of mavplan {rest['versions'].get('mavplan', '?')}, whose planners may "
                "give other numbers; choose another folder"
            )
            problems.append(Problem("versions", message, "other-code"))
        if problems:
            raise InputError([dataclasses.replace(p, where=f"{path}, {p.where}") for p in problems])
        if rest["versions"] != made_with:
            changed = ", ".join(
                f"{name} {rest['versions'].get(name, '?')} → {now}"
                for name, now in made_with.items()
                if rest["versions"].get(name) != now
            )
            message = f"rows of different versions stand in one study ({changed}); last digits may differ"
            warnings = (Problem(str(path), message, "other-versions", "warning"),)
            made_with = rest["versions"]
        if older == settings:
            return warnings
    content = {
        "format": FORMAT,
        "settings": settings.to_json(),
        "stand_ins": stand_ins(),
        "versions": made_with,
    }
    atomic_write(path, json.dumps(content, ensure_ascii=False, indent=2) + "\n")
    return warnings


def _read_settings_file(folder: Path) -> tuple[Settings, dict[str, Any]] | None:
    """Return the settings and all of ``study.json``; None where there is none."""
    path = folder / SETTINGS_FILE
    try:
        content = json.loads(path.read_text("utf-8"))
        if content["format"] != FORMAT:
            raise InputError(
                [Problem(str(path), f"is of format {content['format']}; known is {FORMAT}", "format")]
            )
        content["stand_ins"], content["versions"].items()
        return Settings.from_json(content["settings"]), content
    except FileNotFoundError:
        return None
    except OSError as error:
        message = f"cannot be read: {error.strerror}"
        raise InputError([Problem(str(path), message, "unreadable")]) from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        message = f"is not the settings of a study ({error!r}); choose another folder"
        raise InputError([Problem(str(path), message, "not-a-study")]) from error


def _line(row: Row) -> bytes:
    """Return a row as its line; every float as the shortest text that gives back its bits."""
    return (
        json.dumps(row_values(row), ensure_ascii=False, allow_nan=False, separators=(",", ":")) + "\n"
    ).encode()


def _row(line: bytes) -> Row:
    """Return the row of a line, or raise a `ValueError`."""
    try:
        values = json.loads(line)
        case = Case(**{name: values.pop(name) for name in _CASE_FIELDS})
        return Row(case=case, **values)
    except (TypeError, KeyError, AttributeError, RecursionError) as error:
        raise ValueError("no row of a study") from error


def _read_rows(path: Path, content: bytes, settings: Settings) -> tuple[dict[Key, Row], int]:
    """Return the rows, and how many bytes from the start hold them: what follows was torn by a kill.

    A kill tears the end only. A line in the midst that is no row was damaged otherwise and is not passed over.
    """
    groups, seeds = {dataclasses.replace(group, seed=0) for group in settings.groups()}, set(settings.seeds)
    planners = set(settings.planners)
    rows: dict[Key, Row] = {}
    position = good_bytes = 0
    unreadable: int | None = None
    for number, line in enumerate(content.splitlines(keepends=True), start=1):
        position += len(line)
        try:
            if not line.endswith(b"\n"):
                raise ValueError("torn off")
            row = _row(line)
        except ValueError:
            unreadable = unreadable or number
            continue
        if unreadable is not None:
            message = "is no row of a study, though rows follow: the file was damaged; take it from a copy"
            raise InputError([Problem(f"{path}, line {unreadable:,}", message, "damaged")])
        key = (row.case, row.planner)
        known = dataclasses.replace(row.case, seed=0) in groups and row.case.seed in seeds
        if not known or row.planner not in planners:
            message = f"is of a case or planner that is not in {SETTINGS_FILE}; choose another folder"
            raise InputError([Problem(f"{path}, line {number:,}", message, "other-study")])
        if rows.setdefault(key, row) != row:
            message = "says otherwise than an earlier line of the same case and planner: the file was damaged"
            raise InputError([Problem(f"{path}, line {number:,}", message, "damaged")])
        good_bytes = position
    return rows, good_bytes
