"""Reading ``scenario.toml`` and the users file that it names: every problem in both, reported at once."""

import dataclasses
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mavplan.scenario.checks import (
    check_altitude,
    check_altitudes,
    check_battery,
    check_distances,
    check_planner,
    check_service,
    check_stops,
    check_wind,
    reach_of,
)
from mavplan.scenario.fence_checks import check_fence_places, check_heights
from mavplan.scenario.files import decode, read_text
from mavplan.scenario.kinds import ENDINGS
from mavplan.scenario.lists import ListedThings, read_lists
from mavplan.scenario.model import Scenario, Users
from mavplan.scenario.reference import AREA_LISTS, SECTIONS, keys_of
from mavplan.scenario.report import Report, key_name, listed, nearest, shown
from mavplan.scenario.sections import (
    D2D,
    Columns,
    FenceOptions,
    Home,
    PinnedStop,
    PlannerOptions,
    Radio,
    Service,
    TerrainOptions,
    Vehicle,
    Wind,
)
from mavplan.scenario.terrain import check_terrain, ground_of
from mavplan.scenario.users import FileUsers, read_users
from mavplan.scenario.validate import sound_values

MAX_BYTES = 1024 * 1024
"""A ``scenario.toml`` larger than this is some other file."""

_USERS = (
    "holds users, not a scenario: name it in a scenario as users = \"…\"; 'mavplan init FOLDER' writes one"
)
_MISSION = "is a mission, not a scenario: 'mavplan check', 'export' and 'report' take it"
NO_SCENARIO = {ending: _USERS for ending in ENDINGS if ending != ".txt"} | dict.fromkeys(
    (".plan", ".waypoints", ".json"), _MISSION
)
"""What to say of a file by whose suffix it is none."""


def load_scenario(path: Path | str, *, all_served: bool = True) -> Scenario:
    """Read a scenario and check all of it.

    Parameters
    ----------
    path
        The ``scenario.toml``; the users file stands relative to it.
    all_served
        Whether everybody is to be served; if not, users whom the endurance does not reach are a warning each.

    Returns
    -------
    Scenario
        Users in metres about home; ``d2d.matching`` is what was decided where the file leaves it open; ``warnings``
        holds what was noticed and does not stop the work.

    Raises
    ------
    InputError
        With every error in both files; warnings are left out then.
    """
    path = Path(path)
    report = Report()
    if path.suffix.lower() in NO_SCENARIO and path.is_file():
        report.error(str(path), NO_SCENARIO[path.suffix.lower()], "not-a-scenario")
        report.raise_errors()
    text = read_text(path, str(path), MAX_BYTES, report)
    return _read(text, path.parent, str(path), report, all_served=all_served)


def scenario_of(data: bytes, folder: Path, label: str, *, all_served: bool = True) -> Scenario:
    """Return the scenario in the bytes of a ``scenario.toml``, as `load_scenario` does.

    Parameters
    ----------
    data
        Of the file, at most a byte more than `MAX_BYTES`.
    folder
        Where the users file stands relative to.
    label
        What to call it in problems.
    all_served
        As `load_scenario` takes it.
    """
    report = Report()
    if len(data) > MAX_BYTES:
        report.error(label, f"is longer than the {MAX_BYTES:,} bytes that are read", "unreadable")
    text = decode(data, label, report) if len(data) <= MAX_BYTES else None
    return _read(text, folder, label, report, all_served=all_served)


def _read(text: str | None, folder: Path, label: str, report: Report, *, all_served: bool) -> Scenario:
    data = None if text is None else _parse(text, label, report)
    if data is None:
        report.raise_errors()
        raise AssertionError("a file that could not be read left no problem")
    sections = _Sections(data, label, report)
    things = read_lists(data, folder, label, report)
    users_path = _users_path(data, folder, label, report)
    _note_unknown(data, label, report)
    users = None
    if users_path is not None:
        matching = sections.d2d.matching
        users = read_users(
            users_path,
            str(users_path),
            sections.columns,
            sections.service.demand_mbit,
            report,
            pairs_needed=None if matching is None else matching == "given",
        )
    check_planner(sections.planner, label, report)
    check_service(sections.service, label, report)
    if sections.sound("radio", "vehicle", "service"):
        check_altitude(sections.radio, sections.vehicle, sections.service, label, report)
    if sections.sound("vehicle"):
        check_battery(sections.vehicle, label, report)
        check_altitudes(sections.vehicle, label, report)
    if sections.sound("vehicle", "wind"):
        check_wind(sections.wind, sections.vehicle, label, report)
    if sections.sound("fence", "vehicle"):
        check_heights(things.rally, sections.fence, sections.vehicle, label, report)
    if sections.home is not None and things.sound and sections.sound("fence"):
        check_fence_places(things, sections.fence, sections.home, label, report)
    if data.get("terrain") and sections.sound("terrain", "vehicle", "service"):
        highest_m = (
            sections.vehicle.altitude_max_m if sections.search_altitude else sections.vehicle.altitude_m
        )
        check_terrain(sections.terrain, highest_m, sections.service, label, report)
    if users is not None and sections.home is not None:
        reach = (
            reach_of(sections.vehicle, sections.radio, sections.d2d, sections.service)
            if sections.sound("radio", "vehicle", "service")
            else None
        )
        check_distances(users, sections.home, reach, label, report, things.vehicles, all_served=all_served)
        check_stops(things.stops, users, sections.home, label, report)
    report.raise_errors()
    if users is None or sections.home is None:
        raise AssertionError("a scenario without users or home left no problem")
    scenario = _scenario(sections, sections.home, users, things, label, report)
    if sections.terrain.file is None:
        return scenario
    terrain = ground_of(scenario, users.places, folder, label, report)
    report.raise_errors()
    return dataclasses.replace(scenario, terrain=terrain, warnings=report.warnings())


def _scenario(
    sections: "_Sections", home: Home, users: FileUsers, things: ListedThings, label: str, report: Report
) -> Scenario:
    """Put checked parts together: metres about home, pairs within range."""
    from mavplan.d2d import keep_pairs_in_range, match_pairs, unpaired
    from mavplan.geo import LocalPlane

    xy_m = LocalPlane(home.lat_deg, home.lon_deg).to_xy_m(users.lat_deg, users.lon_deg)
    matching = sections.d2d.matching or ("given" if users.has_pairs else "none")
    d2d = dataclasses.replace(sections.d2d, matching=matching)
    if matching == "given":
        mate, noticed = keep_pairs_in_range(xy_m, users.mate, d2d.range_m, users.names)
    elif matching == "auto":
        mate, noticed = match_pairs(xy_m, d2d.range_m)
    else:
        mate, noticed = unpaired(len(users.names)), ()
    for problem in noticed:
        report.add(dataclasses.replace(problem, where=f"{label}, {problem.where}"))
    return Scenario(
        home=home,
        users=Users(users.names, users.lat_deg, users.lon_deg, xy_m, users.demand_bit, mate, users.priority),
        radio=sections.radio,
        d2d=d2d,
        vehicle=sections.vehicle,
        service=sections.service,
        planner=sections.planner,
        wind=sections.wind,
        fence_options=sections.fence,
        fence=things.fence,
        no_fly=things.no_fly,
        rally=things.rally,
        vehicles=things.vehicles,
        stops=tuple(_placed(stop, users) for stop in things.stops),
        terrain_options=sections.terrain,
        search_altitude=sections.search_altitude,
        warnings=report.warnings(),
    )


def _placed(stop: PinnedStop, users: FileUsers) -> PinnedStop:
    """Return a pinned stop with its place, where it is above a user."""
    if stop.user is None:
        return stop
    number = users.names.index(stop.user)
    place = float(users.lat_deg[number]), float(users.lon_deg[number])
    return dataclasses.replace(stop, lat_deg=place[0], lon_deg=place[1])


def _parse(text: str, label: str, report: Report) -> dict[str, Any] | None:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        message, line = str(error), ""
        if found := re.fullmatch(r"(.*) \(at line ([0-9]+), column ([0-9]+)\)", message, re.DOTALL):
            written = text.splitlines()[int(found[2]) - 1 :][:1]
            message = f"{found[1]} (column {found[3]}){_slip_in(written[0] if written else '')}"
            line = f", line {found[2]}"
        report.error(f"{label}{line}", f"is not valid TOML: {_on_one_line(message)}", "syntax")
    except (ValueError, RecursionError) as error:
        # A number of thousands of digits, brackets nested without end.
        report.error(label, f"is not TOML that can be read: {_on_one_line(str(error))}", "syntax")
    return None


def _slip_in(line: str) -> str:
    """Return what a line that is no TOML probably meant."""
    if found := re.search(r"=\s*([-+]?[0-9]+),([0-9]+)", line):
        return f"; a decimal comma? write {found[1]}.{found[2]}"
    if found := re.search(r"=\s*([-+]?[0-9][0-9_.]*)\s*([A-Za-z°%][^#]*)", line):
        return f"; a number stands without its unit: write {found[1]}"
    if re.search(r"=\s*[A-Za-z][^\"'\[\]{}]*$", line):
        return "; a word stands in quotation marks"
    return ""


def _on_one_line(message: str) -> str:
    """Return a parser's message without characters that a terminal would obey."""
    return "".join(character if character.isprintable() else " " for character in message)


def _users_path(data: dict[str, Any], folder: Path, label: str, report: Report) -> Path | None:
    """Return the users file, relative to the scenario."""
    if "users" not in data:
        report.error(label, 'users is missing; name the users file: users = "users.csv"', "missing-key")
        return None
    name = data["users"]
    if not isinstance(name, str) or not name.strip():
        message = f'found {shown(name)}; allowed is the name of a file: users = "users.csv"'
        report.error(f"{label}, users", message, "wrong-type")
        return None
    if "://" in name or name.startswith("/vsi"):
        message = f"found {shown(name)}; it names a file on this machine: nothing is fetched"
        report.error(f"{label}, users", message, "not-a-file")
        return None
    return folder / name


def _note_unknown(data: dict[str, Any], label: str, report: Report) -> None:
    """Note keys at the top that nobody knows."""
    for name, table in data.items():
        lists = ("rally", "no_fly", "vehicles", "stops")
        if name == "users" or name in lists or name in SECTIONS:
            continue
        known = ["users", *SECTIONS, *lists]
        message = f"is not known{_remedy(name, known, '')}"
        report.error(f"{label}, {key_name(name)}", message, "unknown-key")
        like = nearest(name, list(SECTIONS))
        if like and isinstance(table, dict):
            for key in table:
                if key not in keys_of(like):
                    message = f"is not known{_remedy(key, list(keys_of(like)), like)}"
                    report.error(f"{label}, [{key_name(name)}] {key_name(key)}", message, "unknown-key")


def _remedy(name: str, known: list[str], section: str) -> str:
    """Return where an unknown key belongs, or the nearest known one, or all there are."""
    homes = [
        f"[{other}]" for other in SECTIONS if other not in (section, "columns") and name in keys_of(other)
    ]
    if homes:
        return f"; it belongs in {' or '.join(homes)}"
    like = nearest(name, known)
    return f"; nearest is {like}" if like else f"; known are {listed(known, 20)}"


@dataclass(init=False)
class _Sections:
    """The sections as far as they could be made; a bad value leaves the default in its place, the problem noted."""

    home: Home | None
    columns: Columns
    radio: Radio
    d2d: D2D
    vehicle: Vehicle
    service: Service
    wind: Wind
    fence: FenceOptions
    terrain: TerrainOptions
    planner: PlannerOptions
    search_altitude: bool

    def __init__(self, data: dict[str, Any], label: str, report: Report) -> None:
        self._faulty: set[str] = set()
        self.search_altitude = False
        for name in SECTIONS:
            setattr(self, name, self._make(name, data.get(name), label, report))

    def sound(self, *names: str) -> bool:
        """Return whether nothing in these sections had a problem."""
        return self._faulty.isdisjoint(names)

    def _make(self, name: str, table: Any, label: str, report: Report) -> object:
        kind, keys = SECTIONS[name], keys_of(name)
        required = [key.name for key in keys.values() if key.required]
        if table is None:
            table = {}
            if required:
                self._faulty.add(name)
                report.error(label, f"[{name}] is missing; it needs {_in_words(required)}", "missing-section")
                return None
        if not isinstance(table, dict):
            self._faulty.add(name)
            wrong = "[[…]], a list of tables" if isinstance(table, list) else shown(table)
            report.error(f"{label}, {name}", f"found {wrong}; allowed is one table [{name}]", "wrong-type")
            return None if required else kind()
        if name == "vehicle" and table.get("altitude_m") == "auto":
            self.search_altitude = True
            table = {key: value for key, value in table.items() if key != "altitude_m"}
        lists = AREA_LISTS if name == "fence" else ()
        table = {key: value for key, value in table.items() if key not in lists}
        before, known = report.count, [*keys, *lists]
        good = sound_values(
            kind, keys, table, f"{label}, [{name}]", report, lambda key: _remedy(key, known, name)
        )
        if report.count > before:
            self._faulty.add(name)
        if any(key not in good for key in required):
            return None
        made: object = kind(**good)
        if isinstance(made, Vehicle) and self.search_altitude:
            # Whatever is out of reach from there is so from everywhere above.
            return dataclasses.replace(made, altitude_m=made.altitude_min_m)
        return made


def _in_words(names: list[str]) -> str:
    return f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else names[0]
