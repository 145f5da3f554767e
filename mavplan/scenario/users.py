"""From a users file to checked names, positions, demands and pairs, still in degrees."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mavplan.scenario.coordinates import band_fault, parse_angle, parse_mgrs, parse_utm, utm_to_degrees
from mavplan.scenario.files import decode, read_bytes
from mavplan.scenario.kinds import Kind, kind_of
from mavplan.scenario.model import UNPAIRED, Floats, Ints
from mavplan.scenario.reference import Key, keys_of
from mavplan.scenario.report import Report, figure, listed, shown
from mavplan.scenario.sections import Columns
from mavplan.scenario.table import Row, Table, is_decimal, is_empty, parse_number, parse_text
from mavplan.scenario.users_csv import read_csv
from mavplan.scenario.users_geojson import read_geojson

MAX_BYTES = 64 * 1024 * 1024
"""A users file larger than this is not read: half a million users with all that a city keeps of them."""

_BIT_PER_MBIT = 1e6
_GRIDS = ("utm", "mgrs")


def _read_table(data: bytes, kind: Kind, label: str, report: Report) -> Table | None:
    """Return the rows of a users file, by the reader for its kind."""
    match kind:
        case Kind.KML:
            from mavplan.scenario.users_kml import read_kml

            return read_kml(data, label, report)
        case Kind.KMZ:
            from mavplan.scenario.users_kml import read_kmz

            return read_kmz(data, label, report)
        case Kind.GPX:
            from mavplan.scenario.users_gpx import read_gpx

            return read_gpx(data, label, report)
        case Kind.XLSX:
            from mavplan.scenario.users_xlsx import read_xlsx

            return read_xlsx(data, label, report)
    text = decode(data, label, report)
    if text is None:
        return None
    return read_geojson(text, label, report) if kind is Kind.GEOJSON else read_csv(text, label, report)


@dataclass(frozen=True)
class FileUsers:
    """What a users file holds, N users in its order; a value with a problem is NaN or made up, the problem noted.

    Attributes
    ----------
    names
        N names.
    lat_deg, lon_deg
        (N,) degrees.
    demand_bit
        (N,) bits, the default put in where the file brings none.
    mate
        (N,) index of the mate by the file's pair ids, or `UNPAIRED`.
    has_pairs
        Whether there is a pair column.
    places
        Where each user stands in the file, for problems.
    priority
        (N,) weights; None without such a column.
    """

    names: tuple[str, ...]
    lat_deg: Floats
    lon_deg: Floats
    demand_bit: Floats
    mate: Ints
    has_pairs: bool
    places: tuple[str, ...]
    priority: Floats | None = None


def read_users(
    path: Path,
    label: str,
    columns: Columns,
    default_mbit: float,
    report: Report,
    *,
    pairs_needed: bool | None,
) -> FileUsers | None:
    """Read a users file and note every problem in it.

    Parameters
    ----------
    path, label
        The file, and what to call it in problems.
    columns
        The file's own name for each thing.
    default_mbit
        Demand of a user whose file brings none.
    report
        Takes the problems.
    pairs_needed
        True where pairs must be given, False where a pair column is not read, None where it is read if there is one.

    Returns
    -------
    FileUsers or None
        None where the file cannot be read at all.
    """
    noted = report.count
    data = read_bytes(path, label, MAX_BYTES, report)
    kind = None if data is None else kind_of(data, path.suffix, label, report)
    table = None if data is None or kind is None else _read_table(data, kind, label, report)
    if table is None:
        return None
    if not table.rows:
        if report.count == noted:
            report.error(label, "holds no users; at least one is needed", "empty")
        return None
    names = _names(table, columns, report)
    lat_deg, lon_deg = _positions(table, columns, report)
    demand_bit = _demands(table, columns, default_mbit, names, report)
    pair_column = None
    if pairs_needed is not False:
        pair_column = table.find_column(columns.pair, "pair", report, needed=bool(pairs_needed))
    mate = np.full(len(table.rows), UNPAIRED, dtype=np.int64)
    if pair_column is not None:
        mate = _mates(table, pair_column, report)
    places = tuple(table.place(row) for row in table.rows)
    priority = _priorities(table, columns, report)
    return FileUsers(names, lat_deg, lon_deg, demand_bit, mate, pair_column is not None, places, priority)


def _names(table: Table, columns: Columns, report: Report) -> tuple[str, ...]:
    """Return the users' names: the file's own where it has some, else user-1, user-2 …, all distinct."""
    column = table.find_column(columns.name, "name", report, needed=False)
    names: list[str] = []
    first_row: dict[str, Row] = {}
    for number, row in enumerate(table.rows, start=1):
        name = _text(table, row, column, report) if column is not None else ""
        name = name or f"user-{number}"
        if name in first_row:
            place = f"{table.row_word} {first_row[name].number:,}"
            message = f"found {shown(name)}, the name of {place} too; names must differ"
            report.error(table.place(row, column), message, "duplicate-name")
        else:
            first_row[name] = row
        names.append(name)
    return tuple(names)


def _positions(table: Table, columns: Columns, report: Report) -> tuple[Floats, Floats]:
    """Return latitude and longitude in degrees, NaN where there is a problem."""
    asked = [name for name in _GRIDS if getattr(columns, name) is not None]
    given = {column.lower() for column in table.columns}
    mapped = [getattr(columns, name) for name in _IN_WORDS]
    in_degrees = any(name in given for name in _IN_WORDS) or any(name in table.columns for name in mapped)
    if table.has_geometry or in_degrees:
        for name in asked:
            message = "is not used: the file has positions in degrees"
            report.warning(f"[columns] {name}", message, "not-used")
    else:
        for name in asked or _GRIDS:
            column = table.find_column(getattr(columns, name), name, report, needed=bool(asked))
            if column is not None:
                return _grid_positions(table, name, column, report)
        if asked:
            nowhere = np.full(len(table.rows), np.nan)
            return nowhere, nowhere
    return _degrees(table, columns, "lat_deg", report), _degrees(table, columns, "lon_deg", report)


def _degrees(table: Table, columns: Columns, name: str, report: Report) -> Floats:
    """Return one coordinate of every user, from the geometry or a column."""
    index, key, mapped = int(name == "lon_deg"), keys_of("home")[name], getattr(columns, name)
    values = np.full(len(table.rows), np.nan)
    if table.has_geometry:
        if mapped is not None:
            message = f"{shown(mapped)} is not used: positions are those of the file's geometry"
            report.warning(f"[columns] {name}", message, "not-used")
        for i, row in enumerate(table.rows):
            if row.position is not None:
                place = f"{table.place(row)}, geometry, {_IN_WORDS[name]}"
                values[i] = _number(row.position[index], key, place, report)
    elif (column := table.find_column(mapped, name, report, needed=True)) is not None:
        for i, row in enumerate(table.rows):
            values[i] = _angle(row.cells.get(column), key, table.place(row, column), report)
    return values


def _grid_positions(table: Table, kind: str, column: str, report: Report) -> tuple[Floats, Floats]:
    """Return latitude and longitude of places in UTM or MGRS."""
    lat_deg, lon_deg = np.full(len(table.rows), np.nan), np.full(len(table.rows), np.nan)
    metres: dict[int, tuple[int, bool, float, float, str]] = {}
    for i, row in enumerate(table.rows):
        place = table.place(row, column)
        try:
            text = parse_text(row.cells.get(column))
            if not text:
                report.error(place, "nothing stands there; a position is needed", "missing-value", kind)
            elif kind == "mgrs":
                lat_deg[i], lon_deg[i] = parse_mgrs(text)
            else:
                metres[i] = parse_utm(text)
        except ValueError as problem:
            report.error(place, str(problem), "position", kind)
    if metres:
        lat_deg[list(metres)], lon_deg[list(metres)] = utm_to_degrees(list(metres.values()))
    for i, (*_, band) in metres.items():
        if fault := band_fault(band, lat_deg[i]):
            report.error(table.place(table.rows[i], column), fault, "position", kind)
    return lat_deg, lon_deg


_IN_WORDS = {"lat_deg": "latitude", "lon_deg": "longitude"}


def _like_a_demand(column: str) -> bool:
    """Return whether a column's name sounds like what users need, though nothing says that it is."""
    return any(word in column.lower() for word in ("demand", "need", "mbit", "bedarf", "besoin", "capacity"))


def _demands(
    table: Table, columns: Columns, default_mbit: float, names: tuple[str, ...], report: Report
) -> Floats:
    """Return the demands in bits; where the file brings none, the default, said where only some bring one."""
    column = table.find_column(columns.demand_mbit, "demand_mbit", report, needed=False)
    demand_mbit = np.full(len(table.rows), default_mbit)
    if column is None:
        if not any(_like_a_demand(name) for name in table.columns):
            return demand_mbit * _BIT_PER_MBIT
        message = (
            f"no demands are read, every user is given [service] demand_mbit, {figure(default_mbit)} Mbit; "
            "[columns] demand_mbit names the column that has them"
        )
        report.warning(table.label, message, "no-demands")
        return demand_mbit * _BIT_PER_MBIT
    key = keys_of("service")["demand_mbit"]
    without: list[str] = []
    for i, row in enumerate(table.rows):
        value = row.cells.get(column)
        if is_empty(value):
            without.append(names[i])
        else:
            demand_mbit[i] = _number(value, key, table.place(row, column), report)
    if without:
        who = ", ".join(without[:5]) + (f" and {len(without) - 5:,} more" if len(without) > 5 else "")
        message = (
            f"nothing stands there for {who}: [service] demand_mbit is taken, {figure(default_mbit)} Mbit"
        )
        report.warning(f"{table.label}, {table.column_word} {listed([column])}", message, "default-demand")
    return demand_mbit * _BIT_PER_MBIT


def _priorities(table: Table, columns: Columns, report: Report) -> Floats | None:
    """Return the users' weights, 1 where a cell is empty; None without such a column."""
    column = table.find_column(columns.priority, "priority", report, needed=False)
    if column is None:
        return None
    key = keys_of("user")["priority"]
    weights = np.ones(len(table.rows))
    for i, row in enumerate(table.rows):
        value = row.cells.get(column)
        if not is_empty(value):
            weights[i] = _number(value, key, table.place(row, column), report)
    return weights


def _mates(table: Table, column: str, report: Report) -> Ints:
    """Return each user's mate by pair ids, of which each must stand with exactly two users."""
    members: dict[str, list[int]] = {}
    for i, row in enumerate(table.rows):
        pair = _text(table, row, column, report)
        if pair:
            members.setdefault(pair, []).append(i)
    mate = np.full(len(table.rows), UNPAIRED, dtype=np.int64)
    for pair, users in members.items():
        if len(users) == 2:
            mate[users] = users[::-1]
            continue
        numbers = ", ".join(f"{table.rows[i].number:,}" for i in users[:8])
        where = (
            f"in {table.row_word}{'s' if len(users) > 1 else ''} {numbers}{' …' if len(users) > 8 else ''}"
        )
        count = "once" if len(users) == 1 else f"{len(users):,} times"
        message = f"the pair id {shown(pair)} stands there {count} ({where}); a pair is exactly two users"
        report.error(table.place(table.rows[users[0]], column), message, "unmatched-pair")
    return mate


def _text(table: Table, row: Row, column: str, report: Report) -> str:
    try:
        return parse_text(row.cells.get(column))
    except ValueError as problem:
        report.error(table.place(row, column), str(problem), "bad-text", column)
        return ""


def _angle(value: object, key: Key, place: str, report: Report) -> float:
    """Return a checked angle, decimal or in degrees, minutes and seconds; NaN with the problem noted."""
    if isinstance(value, str) and not is_empty(value):
        try:
            angle = None if is_decimal(value) else parse_angle(value, key)
        except ValueError as problem:
            report.error(place, str(problem), "position", key.name)
            return np.nan
        value = value if angle is None else angle
    return _number(value, key, place, report)


def _number(value: object, key: Key, place: str, report: Report) -> float:
    """Return a checked number, or NaN with the problem noted."""
    if is_empty(value):
        report.error(
            place, f"nothing stands there; allowed is {key.allowed_with_unit}", "missing-value", key.name
        )
        return np.nan
    try:
        return parse_number(value, key)
    except ValueError as problem:
        report.error(place, str(problem), "out-of-range", key.name)
        return np.nan
