"""``mavplan info``: what a vehicle is and holds."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from mavplan.cli.link_options import link_options, open_link

if TYPE_CHECKING:
    from mavplan.link.info_session import VehicleInfo


@click.command("info", short_help="Tell what a vehicle is and holds.")
@link_options(30.0)
def info_command(conn: str, system: int | None, timeout_s: float, signing_key: Path | None) -> None:
    """Tell what a vehicle is and what it holds; nothing is changed.

    \b
    mavplan info --conn udp:0.0.0.0:14550
    """
    from mavplan.cli.console import answer, printable, progress, say_problems, tell
    from mavplan.link.endpoint import parse_endpoint
    from mavplan.link.services import vehicle_info

    endpoint = parse_endpoint(conn)
    with (
        progress(f"asking the vehicle at {endpoint}"),
        open_link(endpoint, timeout_s, signing_key) as connection,
    ):
        info = vehicle_info(connection, deadline_s=timeout_s, system=system, place=str(endpoint))
    say_problems(info.warnings)
    for name, words in _lines(info):
        tell(f"{name:<14}{printable(words)}")
    answer(_document(info))


def _lines(info: "VehicleInfo") -> list[tuple[str, str]]:
    from mavplan.mission.autopilots import AUTOPILOTS

    unknown = "not told"
    counts = ", ".join(
        f"{name}: {unknown if count is None else count}" for name, count in info.counts.items()
    )
    home = info.home
    place = (
        f"{home.lat_e7 / 1e7:.7f}, {home.lon_e7 / 1e7:.7f}, {home.alt_amsl_m:g} m above sea level"
        if home
        else "none told"
    )
    state = info.mission_state or unknown
    item = f", at item {info.current_item}" if info.current_item is not None else ""
    checksum = f", checksum {info.mission_id}" if info.mission_id else ""
    return [
        ("vehicle", f"{info.vehicle}, MAV_TYPE {info.mav_type}"),
        ("autopilot", f"{AUTOPILOTS[info.autopilot].title} {info.version or '(version not told)'}"),
        ("mode", f"{info.mode or unknown}, {'armed' if info.armed else 'not armed'}"),
        ("home", place),
        ("items held", counts),
        ("mission", f"{state}{item}{checksum}"),
        ("fence", info.fence or unknown),
        ("capabilities", ", ".join(info.capabilities) if info.capabilities is not None else unknown),
        ("also heard", "; ".join(info.others) or "nobody"),
    ]


def _document(info: "VehicleInfo") -> dict[str, object]:
    home = info.home
    return {
        "autopilot": info.autopilot,
        "version": info.version,
        "system": info.vehicle.system,
        "component": info.vehicle.component,
        "mav_type": info.mav_type,
        "armed": info.armed,
        "mode": info.mode,
        "home": {"lat_deg": home.lat_e7 / 1e7, "lon_deg": home.lon_e7 / 1e7, "alt_amsl_m": home.alt_amsl_m}
        if home
        else None,
        "items": {name.replace(" ", "_"): count for name, count in info.counts.items()},
        "mission_state": info.mission_state,
        "current_item": info.current_item,
        "opaque_id": info.mission_id,
        "fence": info.fence,
        "capabilities": None if info.capabilities is None else list(info.capabilities),
        "others": list(info.others),
        "warnings": [str(problem) for problem in info.warnings],
    }
