"""Settings that were made before: a file ``mavplan.toml``, and variables ``MAVPLAN_…`` of the environment.

The command line beats the environment, and that the file. What a person says at the time, a yes for instance, is no
setting.
"""

import os
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click

from mavplan.cli.common import IN_PERSON, PREFIX, SHARED, long_name, options_of, variable, variables_of
from mavplan.cli.kinds import Files
from mavplan.errors import InputError, Problem

NAME = "mavplan.toml"
COMMON = "mavplan"
"""The table for every command."""
MAX_BYTES = 1024 * 1024
MOST_LISTED = 30
IN_META = "mavplan.settings"
"""Where click's context holds the file."""


@dataclass(frozen=True, slots=True)
class SettingsFile:
    """A file of settings: a table for each command, and one for all of them.

    Attributes
    ----------
    path
        None: there is none.
    """

    path: Path | None = None
    tables: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


def find_file(named: str | None) -> Path | None:
    """Return the file that is named, else the one of the working folder, else the user's own."""
    if named is not None:
        return Path(named)
    home = os.environ.get("XDG_CONFIG_HOME") or "~/.config"
    found = (Path(NAME), Path(home).expanduser() / "mavplan" / "config.toml")
    return next((path for path in found if path.is_file()), None)


def read_file(path: Path | None, commands: list[str]) -> SettingsFile:
    """Return what a file says.

    Raises
    ------
    InputError
        It cannot be read, or a table is of no command.
    """
    if path is None:
        return SettingsFile()
    try:
        with path.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
        if len(data) > MAX_BYTES:
            raise ValueError(f"is longer than the {MAX_BYTES:,} bytes that are read")
        tables = tomllib.loads(data.decode())
    except OSError as error:
        raise _wrong(path, f"cannot be read: {error.strerror or error}") from error
    except (ValueError, RecursionError) as error:
        raise _wrong(path, f"is not TOML that can be read: {error}") from error
    problems = []
    for name, table in tables.items():
        if name not in (COMMON, *commands):
            message = f"is no command{_nearest(name, [COMMON, *commands])}"
            problems.append(Problem(f"{path}, [{name}]", message, "unknown-key"))
        elif not isinstance(table, dict):
            message = f"is a value; allowed is a table [{name}] of that command's options"
            problems.append(Problem(f"{path}, {name}", message, "wrong-type"))
    if problems:
        raise InputError(problems)
    return SettingsFile(path, tables)


def defaults_of(command: click.Command, found: SettingsFile) -> dict[str, Any]:
    """Return what a file says of a command's options, by the names of click's parameters.

    Raises
    ------
    InputError
        A key is no option, or its value is none that the option takes: all of them.
    """
    problems: list[Problem] = []
    options = {long_name(option): option for option in options_of(command)}
    defaults: dict[str, Any] = {}
    for name in (COMMON, str(command.name)):
        allowed = [key for key in (SHARED if name == COMMON else options) if key not in IN_PERSON]
        for given, value in found.tables.get(name, {}).items():
            key, where = given.replace("_", "-"), f"{found.path}, [{name}] {given}"
            if key in IN_PERSON and key in options:
                message = "is said on the command line only: it stands for a person's word at the time"
                problems.append(Problem(where, message, "in-person"))
            elif key not in allowed:
                problems.append(Problem(where, f"is no setting{_nearest(key, allowed)}", "unknown-key"))
            elif key in options:
                try:
                    defaults[str(options[key].name)] = _taken(options[key], value, found.path)
                except (click.BadParameter, TypeError) as error:
                    message = error.message if isinstance(error, click.BadParameter) else str(error)
                    problems.append(Problem(where, message, "bad-value"))
    if problems:
        raise InputError(problems)
    return defaults


def _taken(option: click.Option, value: Any, file: Path | None) -> Any:
    """Return a value of TOML as the option takes it; paths stand relative to the file."""
    values = value if option.multiple and isinstance(value, list) else [value]
    if option.is_flag and not isinstance(value, bool):
        raise TypeError(f"found {value!r}; allowed are true and false")
    if not option.is_flag and any(
        isinstance(part, bool) or not isinstance(part, str | int | float) for part in values
    ):
        raise TypeError(
            f"found {value!r}; allowed is a text or a number{', or a list of them' if option.multiple else ''}"
        )
    if isinstance(option.type, Files | click.Path) and file is not None:
        values = [
            str(part) if part == "-" else str(file.parent / Path(str(part)).expanduser()) for part in values
        ]
    ctx = click.Context(click.Command("settings"), resilient_parsing=True)
    for part in values:
        option.type.convert(part, option, ctx)
    return values if option.multiple else values[0]


@dataclass(frozen=True, slots=True)
class Setting:
    """One setting that is in force: for which command, which option, which value, and where it was made."""

    command: str
    option: str
    value: str
    made_in: str


def settings_in_force(found: SettingsFile, commands: list[click.Command]) -> Iterator[Setting | Problem]:
    """Yield what environment and file say, each where nothing stronger does, and variables that mean nothing."""
    taken: dict[str, tuple[str, str]] = {}
    for command in commands:
        for option in options_of(command):
            for name in variables_of(command, option):
                taken[name] = (
                    COMMON if name == variable(long_name(option)) else str(command.name),
                    long_name(option),
                )
    said = {
        name: value for name, value in sorted(os.environ.items()) if name.startswith(f"{PREFIX}_") and value
    }
    over = {taken[name] for name in said if name in taken}
    for name, value in said.items():
        if name in taken:
            table, key = taken[name]
            yield Setting(table, key, _shown(key, value), f"environment, {name}")
        elif name != variable("config"):
            yield Problem(name, f"is no setting{_nearest(name, list(taken))}", "unknown-variable", "warning")
    for table, entries in found.tables.items():
        for given, value in entries.items():
            key = given.replace("_", "-")
            if (table, key) not in over:
                yield Setting(table, key, _shown(key, value), f"{found.path}, [{table}]")


def _shown(option: str, value: Any) -> str:
    """Return a value for the eye; what may be a key itself and no file's name is not shown."""
    if option == "signing-key" and not Path(str(value)).expanduser().is_file():
        return "(no such file; not shown)"
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _nearest(name: str, known: list[str]) -> str:
    import difflib

    near = difflib.get_close_matches(name, known, 1)
    if near:
        return f"; nearest is {near[0]}"
    return f"; there are {', '.join(known)}" if 0 < len(known) < MOST_LISTED else ""


def _wrong(path: Path, message: str) -> InputError:
    return InputError([Problem(str(path), " ".join(message.split()), "settings")])
