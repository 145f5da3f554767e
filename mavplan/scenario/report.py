"""Collecting problems: every one is kept with its place, thousands of a kind are summed up, and all are raised once."""

import difflib
import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from mavplan.errors import InputError, Problem

MAX_OF_A_KIND = 20
"""After so many problems of one kind the rest are only counted: nobody reads line 1,960 of the same complaint."""

_MAX_SHOWN = 60


def shown(value: object) -> str:  # noqa: PLR0911 - one answer a type
    """Return a value found in a file as a reader may be shown it: short, quoted, without control characters."""
    match value:
        case bool():
            return "true" if value else "false"
        case None:
            return "nothing"
        case str():
            text = repr(value if len(value) <= _MAX_SHOWN else value[:_MAX_SHOWN] + "…")
            return text if text.startswith('"') else f'"{text[1:-1]}"'
        case dict():
            return "a table"
        case list() | tuple():
            return "a list"
        case int() if abs(value) >= 10**_MAX_SHOWN:
            return "a number of more than sixty digits"
        case _:
            return str(value)


def figure(value: float) -> str:
    """Return a number as people write it: 10,000, 0.8, 1e+20."""
    if not math.isfinite(value) or abs(value) >= 1e20:
        return f"{value:g}"
    return f"{value:,.10g}" if value != int(value) else f"{int(value):,}"


def key_name(key: str) -> str:
    """Return a TOML key as it is, or quoted where it holds more than letters, digits, dashes and underscores."""
    return key if re.fullmatch(r"[A-Za-z0-9_-]{1,60}", key) else shown(key)


def listed(names: Iterable[str], limit: int = 12) -> str:
    """Return names as a list for a sentence, cut after ``limit``."""
    every = list(names)
    text = ", ".join(key_name(name) for name in every[:limit])
    return text if len(every) <= limit else f"{text} and {len(every) - limit:,} more"


def nearest(name: str, known: Sequence[str]) -> str | None:
    """Return the known name that looks most like ``name``, if any comes near."""
    lower = {candidate.lower(): candidate for candidate in reversed(known)}
    close = difflib.get_close_matches(name[:_MAX_SHOWN].lower(), list(lower), n=1, cutoff=0.5)
    return lower[close[0]] if close else None


@dataclass
class Report:
    """Problems in the order in which they were found; at most `MAX_OF_A_KIND` of each kind are kept."""

    _kept: list[tuple[tuple[str, str], Problem]] = field(default_factory=list)
    _counts: Counter[tuple[str, str]] = field(default_factory=Counter)

    def error(self, where: str, message: str, code: str, kind: str = "") -> None:
        """Note something that stops the work. ``kind`` tells problems of one code apart when they are counted."""
        self.add(Problem(where, message, code), kind)

    def warning(self, where: str, message: str, code: str, kind: str = "") -> None:
        """Note something that is only told."""
        self.add(Problem(where, message, code, "warning"), kind)

    def add(self, problem: Problem, kind: str = "") -> None:
        """Note a problem that exists already."""
        counted_as = (problem.code, kind)
        self._counts[counted_as] += 1
        if self._counts[counted_as] <= MAX_OF_A_KIND:
            self._kept.append((counted_as, problem))

    @property
    def count(self) -> int:
        """How many problems were noted so far, those that are only counted included."""
        return self._counts.total()

    def problems(self) -> tuple[Problem, ...]:
        """Return all problems, each kind that was cut followed by how many more there are."""
        found: list[Problem] = []
        kept: Counter[tuple[str, str]] = Counter()
        for kind, problem in self._kept:
            found.append(problem)
            kept[kind] += 1
            more = self._counts[kind] - MAX_OF_A_KIND
            if kept[kind] == MAX_OF_A_KIND and more > 0:
                file = problem.where.split(", ", maxsplit=1)[0]
                found.append(Problem(file, f"and {more:,} more like this", problem.code, problem.severity))
        return tuple(found)

    def warnings(self) -> tuple[Problem, ...]:
        """Return what is only told."""
        return tuple(problem for problem in self.problems() if problem.severity == "warning")

    def raise_errors(self) -> None:
        """Raise one `InputError` with every error, if there is any."""
        errors = [problem for problem in self.problems() if problem.severity == "error"]
        if errors:
            raise InputError(errors)
