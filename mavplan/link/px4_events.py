"""What PX4's events say of a mission it will not fly: `reason_words`. Pure; how they travel is in `event_messages`.

An event's id is the hash of its name, and its arguments follow it packed. Names and arguments are those of PX4's
mission feasibility checker (src/modules/navigator: FeasibilityChecker.cpp and mission_feasibility_checker.cpp), from
1.13 on. PX4 counts items from 1, here they go by their number on the wire.
"""

import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from mavplan.mission.sendable import command_name

AUTOPILOT_COMPONENT = 1 << 24
"""Every event of PX4's own has this in its id, whatever component the vehicle has on the link."""
WARNING = 4
"""Log level: this and below is worse."""
MOST_UNKNOWN = 5


@dataclass(frozen=True, slots=True)
class Event:
    """An event of a vehicle.

    Attributes
    ----------
    id
        Which it is.
    sequence
        Its number, modulo 65,536.
    time_boot_s
        When it happened, on the vehicle's clock.
    level
        Log level for the user, 0 emergency to 7 debug; above that it is not meant for people.
    arguments
        Packed; zero bytes at the end.
    """

    id: int
    sequence: int
    time_boot_s: float
    level: int
    arguments: bytes


def event_id(name: str) -> int:
    """Return the id of an event of PX4: 24 bits of the FNV-1a hash of its name, and the component.

    References
    ----------
    PX4, platforms/common/include/px4_platform_common/events.h; G. Fowler, L. C. Noll, K.-P. Vo, D. Eastlake, "The FNV
    Non-Cryptographic Hash Algorithm", RFC 9923.
    """
    value = 0x811C_9DC5
    for byte in name.encode("ascii"):
        value = ((value ^ byte) * 0x0100_0193) & 0xFFFF_FFFF
    return AUTOPILOT_COMPONENT | (value & 0xFF_FFFF)


ARMING_CHECKS_BEGIN = event_id("commander_arming_check_summary")
ARMING_CHECKS_END = event_id("commander_health_summary")


@dataclass(frozen=True, slots=True)
class Meaning:
    """What an event of the feasibility checker means.

    Attributes
    ----------
    types
        Of its arguments, as `struct` has them.
    words
        Arguments to words.
    decides
        The mission is refused for it; else it is a warning beside (in some versions it decided, too).
    """

    types: str
    words: Callable[..., str]
    decides: bool = True


def _plain(words: str) -> Meaning:
    return Meaning("", lambda: words)


def _of_item(types: str, words: str, *, decides: bool = True) -> Meaning:
    """Say something of an item, which is the only argument."""
    return Meaning(types, lambda number: words.format(item=f"item {number - 1}"), decides)


_NO_HOME_FOR_FENCE = "its geofence needs a home position, and it has none"
_LANDING_FIRST = "the mission begins with a landing"
_LANDING_MISSING = "a landing is required (MIS_TKO_LAND_REQ)"

MEANINGS: dict[str, Meaning] = {
    "navigator_mis_no_pos_lock": _plain("the vehicle has no position yet"),
    "navigator_mis_no_home_rel_alt": _of_item(
        "h", "{item} has a height above home, and the vehicle has no home yet"
    ),
    "navigator_mis_unsup_cmd": Meaning(
        "HH", lambda number, cmd: f"item {number - 1} is {command_name(cmd)}, which it does not fly"
    ),
    "navigator_mis_starts_w_landing": _plain(_LANDING_FIRST),
    "navigator_mis_starts_w_landing2": _plain(_LANDING_FIRST),
    "navigator_mis_takeoff_too_low": Meaning(
        "f", lambda least_m: f"the take-off is too low; it must be above {least_m:.1f} m"
    ),
    "navigator_mis_takeoff_not_first": _plain("the take-off is not the first item with a place"),
    "navigator_mis_takeoff_missing": _plain("a take-off is required (MIS_TKO_LAND_REQ)"),
    "navigator_mis_land_missing": _plain(_LANDING_MISSING),
    "feasibility_mis_in_air_landing_req": _plain(_LANDING_MISSING),
    "navigator_mis_takeoff_or_land_missing": _plain(
        "a take-off and a landing are required (MIS_TKO_LAND_REQ)"
    ),
    "navigator_mis_add_land_or_rm_to": _plain("with a take-off it needs a landing too (MIS_TKO_LAND_REQ)"),
    "navigator_mis_add_to_or_rm_land": _plain("with a landing it needs a take-off too (MIS_TKO_LAND_REQ)"),
    "navigator_mis_vtol_items": _plain("it has items for a VTOL, which the vehicle is not"),
    "navigator_mis_wp_gate_too_close": Meaning(
        "ff",
        lambda apart_m, least_m: (
            f"a waypoint and a gate are {apart_m:.3f} m apart, at least {least_m:.3f} m are needed"
        ),
    ),
    "navigator_mis_wp_dist_too_far": Meaning(
        "II", lambda apart_m, most_m: f"two waypoints are {apart_m:,} m apart, more than {most_m:,} m"
    ),
    "navigator_mis_first_wp_too_far": Meaning(
        "II",
        lambda away_m, most_m: (
            f"the first waypoint is {away_m:,} m away, more than {most_m:,} m (MIS_DIST_1WP)"
        ),
        decides=False,
    ),
    "navigator_mis_wp_below_home": _of_item("h", "{item} is below home", decides=False),
    "navigator_mis_geofence_no_home": _plain(_NO_HOME_FOR_FENCE),
    "navigator_mis_geofence_no_home2": _plain(_NO_HOME_FOR_FENCE),
    "navigator_mis_geofence_violation": _of_item("h", "{item} breaches the vehicle's geofence"),
    "navigator_mis_geofence_path_violation": _of_item(
        "H", "the way to {item} breaches the vehicle's geofence"
    ),
    "navigator_mis_geofence_loiter_breach": _of_item(
        "H", "the circle about {item} breaches the vehicle's geofence"
    ),
    "navigator_mis_geofence_jump_breach": _of_item("H", "the jump of {item} breaches the vehicle's geofence"),
    "navigator_mis_geofence_unavailable": _plain("the vehicle could not check its geofence"),
    "navigator_mis_do_jump_invalid": _of_item("H", "the jump of {item} leads nowhere"),
    "navigator_mis_act_index": Meaning("i", lambda number: f"there is no actuator {number}"),
    "navigator_mis_act_range": Meaning(
        "iI", lambda value, most: f"an actuator value of {value} is outside -{most} to {most}"
    ),
    "navigator_mis_sd_failure": _plain("the vehicle cannot read its mission storage"),
    "navigator_mis_dm_read_fail": Meaning(
        "HB", lambda index, _: f"the vehicle cannot read item {index} from its storage"
    ),
    "navigator_mis_approach_wp_below_land": _plain("the approach waypoint is not above the landing"),
    "navigator_mis_land_wp_inside_orbit_radius": _plain(
        "the landing is inside the radius of the orbit before"
    ),
    "navigator_mis_unsupported_landing_approach_wp": _plain(
        "before the landing there is neither a waypoint nor an orbit to altitude"
    ),
    "navigator_mis_glide_slope_too_steep": Meaning(
        "BB", lambda whole, tenths: f"the glide slope is steeper than {whole}.{tenths} degrees"
    ),
    "navigator_mis_correct_glide_slope": Meaning(
        "II",
        lambda alt_m, away_m: (
            f"the glide slope wants an entrance at {alt_m:,} m or an approach of {away_m:,} m"
        ),
    ),
    "navigator_mis_land_approach": Meaning(
        "ii",
        lambda down_m, away_m: (
            f"the landing approach is too steep: {down_m} m in height, {away_m} m in length"
        ),
    ),
    "navigator_mis_multiple_land": _plain("it has more than one DO_LAND_START"),
    "navigator_mis_land_before_rtl": _plain("a DO_LAND_START stands before a return to launch"),
    "navigator_mis_invalid_land": _plain("its DO_LAND_START has no landing behind it"),
}
"""By the event's name."""

BY_ID: dict[int, Meaning] = {event_id(name): meaning for name, meaning in MEANINGS.items()}


def decides(event: Event) -> bool:
    """Whether a mission is refused for what this event says."""
    meaning = BY_ID.get(event.id)
    return meaning is not None and meaning.decides


def event_words(event: Event) -> str:
    """Return what an event means; of one that is not in `MEANINGS` its number."""
    meaning = BY_ID.get(event.id)
    if meaning is None:
        return f"it sent event 0x{event.id:08x}, whose meaning is not known here"
    layout = struct.Struct(f"<{meaning.types}")
    values: tuple[Any, ...] = layout.unpack(event.arguments.ljust(layout.size, b"\0")[: layout.size])
    return meaning.words(*values)


def reason_words(events: Sequence[Event]) -> tuple[str, ...]:
    """Return why a mission was judged not flyable, as the events since its upload tell; empty where they do not.

    What decides comes alone. Where nothing does, what the checker only warned about, and then warnings whose meaning
    is not known here, by their numbers.

    Parameters
    ----------
    events
        In the order in which they happened.
    """
    known = [event for event in events if event.id in BY_ID]
    strange = [event for event in _without_arming_checks(events) if event.id not in BY_ID]
    warnings = [event for event in strange if event.level <= WARNING][:MOST_UNKNOWN]
    chosen = [event for event in known if decides(event)] or known or warnings
    return tuple(dict.fromkeys(event_words(event) for event in chosen))


def _without_arming_checks(events: Sequence[Event]) -> Iterator[Event]:
    """Leave out what stands between the two summaries that PX4 puts about its health and arming checks."""
    inside = False
    for event in events:
        if event.id == ARMING_CHECKS_BEGIN:
            inside = True
        elif event.id == ARMING_CHECKS_END:
            inside = False
        elif not inside:
            yield event
