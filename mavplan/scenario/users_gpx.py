"""Users from GPX, as hand-held receivers write it: a waypoint a user, WGS84."""

from mavplan.scenario.report import Report
from mavplan.scenario.table import Row, Table
from mavplan.scenario.xml_reading import elements, local_name, text_of

_TEXTS = ("name", "cmt", "desc", "sym", "type")


def read_gpx(data: bytes, label: str, report: Report) -> Table | None:
    """Return the waypoints of a GPX file; its routes and tracks are where somebody went, not users.

    A waypoint's ``ele`` is not read: receivers write heights above the ellipsoid or the sea, and do not say which.

    Parameters
    ----------
    data
        Content of the file.
    label
        What to call it in problems.
    report
        Takes the problems.
    """
    rows: list[Row] = []
    columns: dict[str, None] = {"name": None}
    passed_over: dict[str, int] = {"rte": 0, "trk": 0}
    noted = report.count
    for element in elements(data, frozenset({"wpt", "rte", "trk"}), label, report):
        kind = local_name(element)
        if kind in passed_over:
            passed_over[kind] += 1
            continue
        cells: dict[str, object] = {local_name(found): text_of(found) for found in element}
        cells = {name: cells[name] for name in _TEXTS if name in cells}
        columns.update(dict.fromkeys(cells))
        position = (element.get("lat"), element.get("lon"))
        rows.append(Row(len(rows) + 1, cells, position))
    if rows:
        if told := _in_words(passed_over):
            report.warning(label, f"its {told} are not read: users are its waypoints", "not-used")
    elif report.count > noted:
        return None
    elif told := _in_words(passed_over):
        report.error(label, f"holds {told}, no waypoints; a waypoint a user is expected", "empty")
        return None
    return Table(label, "waypoint", "field", tuple(columns), rows, has_geometry=True)


def _in_words(passed_over: dict[str, int]) -> str:
    words = {"rte": "routes", "trk": "tracks"}
    return " and ".join(f"{count:,} {words[name]}" for name, count in passed_over.items() if count)
