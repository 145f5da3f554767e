"""The list before a start: what is looked at, and the verdict on each line. Pure: what is known in, lines out."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from mavplan.errors import MavplanError, Problem
from mavplan.flight.route import Route
from mavplan.flight.telemetry import AIRBORNE, FIX_3D, Telemetry
from mavplan.link.home import distance_m
from mavplan.mission.model import HomePosition

Verdict = Literal["good", "warning", "ask", "refused"]
"""``ask``: it may be flown after a yes to just this."""

FRESH_S = 5.0
"""What was told longer ago is not known any more."""
MIN_BATTERY_PERCENT = 30.0
ON_GROUND_WITHIN_M = 20.0
"""A vehicle whose height above home says more than this does not stand at its home."""
STANDS_BELOW_M_S = 2.0
HOME_IS_HERE_M = 30.0
"""Autopilots take home anew where they are armed: further away, every height and the way back would change."""


@dataclass(frozen=True, slots=True)
class Check:
    """One line of the list.

    Attributes
    ----------
    name
        Short and stable: ``vehicle``, ``mission``, ``home``, ``position``, ``battery``, ``fence``, ``arming``,
        ``link loss``, ``end``.
    verdict
        What it means for the flight.
    words
        What was found, and where it is bad, what to do.
    """

    name: str
    verdict: Verdict
    words: str


@dataclass(frozen=True, slots=True)
class Limits:
    """What the user allows.

    Attributes
    ----------
    max_home_distance_m, max_home_height_m
        As for an upload.
    min_battery_percent
        Less than this on the ground is refused.
    battery_wh, needed_wh
        The whole battery, and what the plan's forecast takes with its reserve; None where that is not known.
    """

    max_home_distance_m: float
    max_home_height_m: float
    min_battery_percent: float = MIN_BATTERY_PERCENT
    battery_wh: float | None = None
    needed_wh: float | None = None


def refused(checks: Sequence[Check]) -> tuple[Check, ...]:
    """Return the lines that stand against a flight."""
    return tuple(check for check in checks if check.verdict == "refused")


def refusal_words(checks: Sequence[Check]) -> str:
    """Return why it may not fly, in one sentence."""
    return "; ".join(f"{check.name}: {check.words}" for check in refused(checks))


def vehicle_check(title: str, telemetry: Telemetry, now: float) -> Check:
    """Judge whether it stands on the ground, not armed, and is heard."""
    heard_at = telemetry.heartbeat_at
    if heard_at is None or now > heard_at + FRESH_S:
        silent = "" if heard_at is None else f" for {now - heard_at:.0f} s"
        return Check("vehicle", "refused", f"{title} is not heard{silent}")
    if telemetry.armed_now:
        return Check("vehicle", "refused", f"{title} is armed already; --watch only watches it")
    if telemetry.landed.value in AIRBORNE:
        return Check("vehicle", "refused", f"{title} says that it is in the air; --watch only watches it")
    return Check("vehicle", "good", f"{title}, {telemetry.vehicle}, not armed")


def mission_check(
    found: str | MavplanError | None, warnings: Sequence[Problem] = (), replaced: bool = False
) -> Check:
    """Judge whether the vehicle holds this mission.

    Parameters
    ----------
    found
        How that is known, or why it is not so; None: not looked yet.
    warnings
        What the verification warned of.
    replaced
        The vehicle announces another one since.
    """
    if found is None:
        return Check("mission", "refused", "whether the vehicle holds it was not looked at")
    if isinstance(found, MavplanError):
        return Check("mission", "refused", f"{found}; --upload sends it first")
    if replaced:
        return Check("mission", "refused", "the vehicle announces another one since it was verified")
    if any(problem.code == "not-flyable" for problem in warnings):
        return Check("mission", "refused", "the vehicle holds it but judges it not flyable")
    return Check("mission", "good", found)


def home_check(planned: HomePosition, home: HomePosition | None, limits: Limits) -> Check:
    """Judge whether the vehicle's home is the mission's."""
    if home is None:
        return Check(
            "home", "refused", "the vehicle has told none yet: wait until it knows its place, try again"
        )
    away_m, higher_m = distance_m(planned, home), home.alt_amsl_m - planned.alt_amsl_m
    found = (
        f"{away_m:,.0f} m from the mission's, {abs(higher_m):,.0f} m {'higher' if higher_m > 0 else 'lower'}"
    )
    if away_m > limits.max_home_distance_m:
        most = f"more than {limits.max_home_distance_m:,.0f} m (--max-home-distance)"
        return Check("home", "refused", f"{found}, {most}: plan for where it stands")
    if abs(higher_m) > limits.max_home_height_m:
        most = f"more than {limits.max_home_height_m:,.0f} m (--max-home-height)"
        return Check("home", "refused", f"{found}, {most}: plan for where it stands")
    return Check("home", "good", found)


def position_check(
    planned: HomePosition, home: HomePosition | None, telemetry: Telemetry, limits: Limits, now: float
) -> Check:
    """Judge whether it knows where it is, stands still, and stands where the mission begins."""
    position = telemetry.position
    if position is None or now > position.at + FRESH_S:
        return Check("position", "refused", "the vehicle does not tell where it is")
    here = HomePosition(position.lat_e7, position.lon_e7, position.alt_amsl_m)
    words = f"{position.lat_e7 / 1e7:.7f}, {position.lon_e7 / 1e7:.7f}, {position.alt_rel_m:.1f} m above home"
    in_range = abs(position.lat_e7) <= 900_000_000 and abs(position.lon_e7) <= 1_800_000_000
    if not in_range or not (position.lat_e7 or position.lon_e7):
        return Check("position", "refused", f"{words}: that is no place")
    if telemetry.fix is not None and telemetry.fix < FIX_3D:
        return Check("position", "refused", f"{words}, but its receiver has no fix")
    found = [words]
    away_m = distance_m(here, planned)
    if away_m > limits.max_home_distance_m:
        found.append(f"{away_m:,.0f} m from the mission's home (--max-home-distance)")
    if abs(position.alt_rel_m) > ON_GROUND_WITHIN_M:
        found.append("it cannot be standing at its home")
    if position.speed_m_s > STANDS_BELOW_M_S:
        found.append(f"it moves at {position.speed_m_s:.1f} m/s")
    if len(found) > 1:
        return Check("position", "refused", "; ".join(found))
    if home is not None and (from_home_m := distance_m(here, home)) > HOME_IS_HERE_M:
        return Check(
            "position", "warning", f"{words}; {from_home_m:,.0f} m from its home, which arming moves here"
        )
    return Check("position", "good", words)


def battery_check(telemetry: Telemetry, limits: Limits) -> Check:
    """Judge whether the battery is enough."""
    battery, needed_wh = telemetry.battery, limits.needed_wh
    needs = (
        f"the plan takes {needed_wh:.0f} Wh"
        if needed_wh is not None
        else "the plan does not say what it takes"
    )
    if battery is None or battery.percent is None:
        volts = "" if battery is None or battery.voltage_v is None else f" ({battery.voltage_v:.1f} V)"
        return Check(
            "battery", "warning", f"the vehicle does not tell what is left{volts}; {needs}: look yourself"
        )
    volts = "" if battery.voltage_v is None else f", {battery.voltage_v:.1f} V"
    found = f"{battery.percent} %{volts}"
    if battery.percent < limits.min_battery_percent:
        return Check(
            "battery", "refused", f"{found}, less than {limits.min_battery_percent:g} % (--min-battery)"
        )
    if needed_wh is None or limits.battery_wh is None:
        return Check("battery", "good", f"{found}; {needs}")
    left_wh = limits.battery_wh * battery.percent / 100
    found = f"{found}: {left_wh:.0f} of {limits.battery_wh:.0f} Wh; {needs}, with its reserve"
    return Check("battery", "good" if left_wh >= needed_wh else "refused", found)


def fence_check(
    words: str, enforced: Sequence[str] | None, breached: Sequence[str], problems: Sequence[Problem]
) -> Check:
    """Judge what the vehicle makes of fences, from `mavplan.mission.fence_force`."""
    if breached:
        found = "; ".join(str(problem) for problem in problems if problem.code == "fence-breach")
        return Check("fence", "refused", f"the mission would not be flown to its end: {found}")
    if enforced is None:
        return Check("fence", "warning", words)
    idle = [problem.message for problem in problems if problem.code != "fence-would-breach"]
    if idle:
        return Check("fence", "warning", "; ".join(idle))
    return Check("fence", "good", words)


def arming_check(telemetry: Telemetry) -> Check:
    """Judge whether it can be armed; where it cannot yet, it is tried all the same."""
    if telemetry.ready_to_arm:
        return Check("arming", "good", "the vehicle says that it can be armed")
    texts = [text for text in telemetry.texts_since(-math.inf) if is_arming_text(text)]
    said = f": {'; '.join(repr(text) for text in texts[-3:])}" if texts else ""
    if telemetry.ready_to_arm is None:
        return Check(
            "arming", "good" if not said else "warning", f"the vehicle does not tell beforehand{said}"
        )
    return Check("arming", "warning", f"the vehicle cannot be armed yet{said}; it will be tried")


def is_arming_text(text: str) -> bool:
    """Whether a STATUSTEXT tells why it cannot be armed."""
    low = text.lower()
    return low.startswith(("prearm", "arm:", "preflight fail", "arming denied")) or "not arm" in low


def link_loss_check(ardupilot_value: float | None, px4_value: float | None) -> Check:
    """Judge what the vehicle does when it hears no ground station, from FS_GCS_ENABLE or NAV_DLL_ACT."""
    for name, value in (("FS_GCS_ENABLE", ardupilot_value), ("NAV_DLL_ACT", px4_value)):
        if value is None:
            continue
        if value == 0:
            return Check("link loss", "good", f"the vehicle flies on ({name} is 0)")
        found = f"the vehicle breaks off its mission when it hears no ground station ({name} is {value:g})"
        return Check("link loss", "warning", f"{found}: stay in reach, and do not end mavplan")
    return Check("link loss", "warning", "the vehicle does not tell what it does when the link is lost")


def end_check(route: Route) -> Check:
    """Judge how the mission ends: what does not come home by itself is asked for."""
    match route.end:
        case "rtl":
            return Check("end", "good", "returns and lands at home")
        case "land" if route.comes_home:
            return Check("end", "good", "flies back and lands at home")
        case "land":
            return Check("end", "ask", "lands at the last stop, whatever is there")
    found = "hovers at the last stop until its battery failsafe acts or somebody takes over"
    return Check("end", "ask", found)
