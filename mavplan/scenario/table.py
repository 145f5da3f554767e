"""A users file before it is understood: rows of raw cells with the place of each, and finding a column in it."""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from mavplan.scenario.reference import Key, keys_of
from mavplan.scenario.report import Report, listed, nearest, shown

_DECIMAL = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?")
_DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+")


class Row(NamedTuple):
    """One user as the file has it.

    ``number`` is the line or feature, ``cells`` the values by column; ``position`` is (latitude, longitude) as found
    where the format has a place for it, else None.
    """

    number: int
    cells: Mapping[str, object]
    position: tuple[object, object] | None = None


@dataclass(frozen=True)
class Table:
    """A users file as raw rows.

    Attributes
    ----------
    label
        What the file is called in problems.
    row_word, column_word
        What its rows and columns are called there, as ``line`` and ``column``, ``feature`` and ``property``.
    columns
        Names of all columns, in the order of the file.
    rows
        The users.
    has_geometry
        Whether positions are the format's own; a row without one then had a problem that is noted already.
    """

    label: str
    row_word: str
    column_word: str
    columns: tuple[str, ...]
    rows: list[Row] = field(default_factory=list)
    has_geometry: bool = False

    def place(self, row: Row, column: str | None = None) -> str:
        """Return file, row and column for a problem."""
        place = f"{self.label}, {self.row_word} {row.number:,}"
        return place if column is None else f"{place}, {self.column_word} {plain(column)}"

    def find_column(self, mapped: str | None, key: str, report: Report, *, needed: bool) -> str | None:
        """Return the column that holds ``key``, or None.

        A mapped column must be there as it is spelt. Without a mapping the column has the key's own name, upper and
        lower case not told apart where only one column fits.

        Parameters
        ----------
        mapped
            What ``[columns]`` says for this key.
        key
            Name of the key in ``[columns]``.
        report
            Takes the problem of a column that is missing or ambiguous.
        needed
            Whether a file without this column is refused.
        """
        wanted = key if mapped is None else mapped
        if wanted in self.columns:
            return wanted
        if mapped is None:
            alike = [column for column in self.columns if column.lower() == key]
            if len(alike) == 1:
                return alike[0]
            if alike:
                message = f"{listed(alike)} could all be {key}: say which in [columns] {key}"
                report.error(self.label, message, "ambiguous-column")
                return None
        if needed or mapped is not None:
            found = listed(self.columns) if self.columns else "none"
            others = keys_of("columns").keys() if mapped is None else ()
            like = nearest(wanted, [column for column in self.columns if column.lower() not in others])
            hint = f"; nearest is {plain(like)}" if like else ""
            remedy = "" if mapped is not None else f"; if another holds it, say which in [columns] {key}"
            asked = "" if mapped is None else f", which [columns] {key} names"
            message = (
                f"there is no {self.column_word} {plain(wanted)}{asked}; those there: {found}{hint}{remedy}"
            )
            report.error(self.label, message, "missing-column")
        return None


def is_usable_header(header: tuple[str, ...], place: str, report: Report) -> bool:
    """Return whether no two columns have the same name; unnamed ones are never asked for."""
    twice = [name for name, count in Counter(header).items() if count > 1 and name]
    for name in twice:
        report.error(place, f"the column {plain(name)} is there twice", "duplicate-column")
    return not twice


def plain(name: str) -> str:
    """Return a column's name as it is, or quoted where it could not be told from the sentence or is not printable."""
    return name if name.isprintable() and 0 < len(name) <= 60 and name == name.strip() else shown(name)


def parse_number(value: object, key: Key) -> float:
    """Return a cell as a number within the range of its key.

    Raises
    ------
    ValueError
        With the sentence for the reader: what was found and what is allowed.
    """
    number = _number(value, key)
    if not key.holds(number):
        raise ValueError(f"found {shown(value)}; allowed is {key.allowed_with_unit}")
    return number


def _number(value: object, key: Key) -> float:
    allowed = f"allowed is {key.allowed_with_unit}"
    if isinstance(value, str):
        text = value.strip()
        if is_decimal(text):
            return float(text)
        if _DECIMAL_COMMA.fullmatch(text):
            point = text.replace(",", ".")
            raise ValueError(f"found {shown(value)}, a decimal comma; write a point: {point}")
        raise ValueError(f"found {shown(value)}, which is not a plain decimal number; {allowed}")
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"found {shown(value)}; {allowed}")
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"found {shown(value)}; {allowed}") from None


def is_decimal(text: str) -> bool:
    """Return whether a text is a plain decimal number."""
    return _DECIMAL.fullmatch(text.strip()) is not None


def parse_text(value: object) -> str:
    """Return a cell as text without surplus white space; empty for a cell with nothing in it.

    Whole numbers are taken as the text they are written as, so that 7 and "7" are the same pair.

    Raises
    ------
    ValueError
        With the sentence for the reader.
    """
    match value:
        case None:
            return ""
        case bool():
            pass
        case str():
            text = " ".join(value.split())
            if any(
                character < " " or "\x7f" <= character < "\xa0" or _is_surrogate(character)
                for character in text
            ):
                raise ValueError(f"found {shown(value)}, with characters that cannot be written")
            return text
        case float() if value.is_integer() and abs(value) < 1e15:
            return str(int(value))
        case int() if abs(value) < 10**18:
            return str(value)
        case float():
            return str(value)
    raise ValueError(f"found {shown(value)}; allowed is text or a number")


def _is_surrogate(character: str) -> bool:
    return "\ud800" <= character <= "\udfff"


def is_empty(value: object) -> bool:
    """Return whether a cell holds nothing: null, or only white space."""
    return value is None or (isinstance(value, str) and not value.strip())
