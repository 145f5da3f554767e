"""The named failure modes, and how they are written: ``drop=0.3,dup=0.1,reorder,delay=200ms,silent-after=7``.

What they do is in `network` and, for those in flight, in `flight.pilot`. All chance comes from one seed, so a run can
be repeated.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from sitl_mock.flight.faults import AtItem, FlightFaults
from sitl_mock.items import Result


@dataclass(frozen=True, slots=True)
class Moment:
    """When something happens: with the so-manyth mission item that passes, or at a time."""

    item: int | None = None
    time_s: float | None = None


@dataclass(frozen=True, slots=True)
class Faults:
    """What goes wrong; the default is nothing.

    Attributes
    ----------
    drop_up, drop_down
        Probability that a frame to the vehicle, or from it, is lost.
    dup
        Probability that a frame arrives twice.
    reorder
        Probability that a frame is held back so that later ones overtake it.
    delay_s, jitter_s
        Time on the way, and up to so much more at random, without overtaking.
    corrupt
        Probability that one byte of a frame is changed.
    first_lost
        The first copy of every different mission frame is lost, either way.
    silent_after
        The vehicle says nothing any more.
    reboot_at
        The vehicle loses power for a moment.
    ack_lost
        So many MISSION_ACKs of success from the vehicle are lost.
    early_ack
        An ACK of success comes right behind the client's MISSION_COUNT.
    nack
        Every MISSION_COUNT is answered with this and does not reach the vehicle.
    alter
        The mission item of this number arrives a metre off, in a good frame.
    no_heartbeat
        The vehicle's heartbeats are lost.
    second_gcs
        Another ground station on the same radio: ``read`` downloads again and again, ``upload`` writes a mission of
        its own as soon as somebody else's was accepted.
    flight
        What goes wrong in the air.
    """

    drop_up: float = 0.0
    drop_down: float = 0.0
    dup: float = 0.0
    reorder: float = 0.0
    delay_s: float = 0.0
    jitter_s: float = 0.0
    corrupt: float = 0.0
    first_lost: bool = False
    silent_after: Moment | None = None
    reboot_at: Moment | None = None
    ack_lost: int = 0
    early_ack: bool = False
    nack: Result | None = None
    alter: int | None = None
    no_heartbeat: bool = False
    second_gcs: str = ""
    flight: FlightFaults = field(default_factory=FlightFaults)

    @property
    def on_the_way(self) -> bool:
        """Whether anything goes wrong that is not in the air."""
        return replace(self, flight=FlightFaults()) != Faults()


@dataclass(frozen=True, slots=True)
class FaultName:
    """One name: the fields it sets, how its value is read (None: it has none), its value where none is given."""

    fields: tuple[str, ...]
    read: Callable[[str], Any] | None
    default: Any
    explains: str
    in_flight: bool = False


def _probability(text: str) -> float:
    value = float(text)
    if not 0.0 <= value <= 1.0:
        raise ValueError("a probability from 0 to 1")
    return value


def _seconds(text: str) -> float:
    number, divisor = (text[:-2], 1000.0) if text.endswith("ms") else (text.removesuffix("s"), 1.0)
    value = float(number) / divisor
    if not (0.0 <= value < math.inf):
        raise ValueError("a time such as 200ms or 1.5s")
    return value


def _moment(text: str) -> Moment:
    if text.endswith("s"):
        return Moment(time_s=_seconds(text))
    return Moment(item=_count(text))


def _count(text: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text) <= 65535):
        raise ValueError("a number from 0 to 65535")
    return int(text)


def _result(text: str) -> Result:
    name = text.upper().removeprefix("MAV_MISSION_")
    if name in Result.__members__ and name != "ACCEPTED":
        return Result[name]
    raise ValueError("one of " + ", ".join(result.name for result in Result if result is not Result.ACCEPTED))


def _at_item(unit: str, usual: float) -> Callable[[str], AtItem]:
    def read(text: str) -> AtItem:
        item, slash, amount = text.partition("/")
        value = float(amount.removesuffix(unit)) if slash else usual
        if not 0.0 < value < 1e5:
            raise ValueError(f"an item and an amount such as 4/{usual:g}{unit}")
        return AtItem(_count(item), value)

    return read


def _station(text: str) -> str:
    if text not in {"read", "upload"}:
        raise ValueError("read or upload")
    return text


FAULTS: Mapping[str, FaultName] = MappingProxyType(
    {
        "drop": FaultName(("drop_up", "drop_down"), _probability, 0.3, "frames lost, either way"),
        "drop-up": FaultName(("drop_up",), _probability, 0.3, "frames to the vehicle lost"),
        "drop-down": FaultName(("drop_down",), _probability, 0.3, "frames from the vehicle lost"),
        "dup": FaultName(("dup",), _probability, 0.2, "frames that arrive twice"),
        "reorder": FaultName(("reorder",), _probability, 0.2, "frames overtaken by later ones"),
        "delay": FaultName(("delay_s",), _seconds, 0.2, "time on the way, each way"),
        "jitter": FaultName(("jitter_s",), _seconds, 0.1, "up to so much more time on the way, at random"),
        "corrupt": FaultName(("corrupt",), _probability, 0.01, "frames with a wrong byte"),
        "first-lost": FaultName(("first_lost",), None, True, "the first copy of every mission frame is lost"),
        "silent-after": FaultName(
            ("silent_after",), _moment, Moment(item=7), "silence after N mission items, or Ts"
        ),
        "reboot-at": FaultName(
            ("reboot_at",), _moment, Moment(item=12), "a reboot at mission item N, or at Ts"
        ),
        "ack-lost": FaultName(
            ("ack_lost",), _count, 65535, "the first N final acknowledgements are lost (all)"
        ),
        "early-ack": FaultName(
            ("early_ack",), None, True, "an acknowledgement comes before the first request"
        ),
        "nack": FaultName(
            ("nack",), _result, Result.ERROR, "every upload is refused with this MAV_MISSION_RESULT"
        ),
        "alter": FaultName(("alter",), _count, 2, "mission item N is stored a metre off"),
        "no-heartbeat": FaultName(("no_heartbeat",), None, True, "no heartbeat from the vehicle"),
        "second-gcs": FaultName(
            ("second_gcs",), _station, "read", "another ground station reads, or uploads too"
        ),
        "hold-cut": FaultName(
            ("hold_cut",), _count, 3, "the hold of mission item N is cut by half", in_flight=True
        ),
        "gust": FaultName(
            ("gust",),
            _at_item("m", 200.0),
            AtItem(3, 200.0),
            "wind pushes it 200 m (N/200m) off at item N",
            in_flight=True,
        ),
        "battery-drop": FaultName(
            ("battery_drop",), _count, 3, "half of the energy that is left is lost at item N", in_flight=True
        ),
        "position-lost": FaultName(
            ("position_lost",),
            _at_item("s", 20.0),
            AtItem(3, 20.0),
            "no position for 20 s (N/20s) from item N on",
            in_flight=True,
        ),
        "crash": FaultName(("crash",), _count, 3, "the motors stop at item N", in_flight=True),
    }
)
"""Every name with its value where none is given; `fault_help` prints it."""


def parse_faults(text: str, base: Faults | None = None) -> Faults:
    """Read ``name=value,name,…`` and add it to `base`.

    Raises
    ------
    ValueError
        One sentence for each unknown name and each value that cannot be.
    """
    faults = base or Faults()
    problems: list[str] = []
    for part in filter(None, (part.strip() for part in text.split(","))):
        name, equals, value = part.partition("=")
        known = FAULTS.get(name.strip())
        if known is None:
            problems.append(f"fault {name!r} is unknown; known are {', '.join(FAULTS)}")
        elif equals and known.read is None:
            problems.append(f"fault {name!r} takes no value")
        else:
            try:
                setting = known.read(value.strip()) if equals and known.read else known.default
            except ValueError as wrong:
                reason = str(wrong) if not str(wrong).startswith("could not") else "a number"
                problems.append(f"fault {name!r} wants {reason}, not {value!r}")
            else:
                fields = dict.fromkeys(known.fields, setting)
                if known.in_flight:
                    fields = {"flight": replace(faults.flight, **fields)}
                faults = replace(faults, **fields)
    if problems:
        raise ValueError("; ".join(problems))
    return faults


def fault_help() -> str:
    """Return the list of names for a command's help, a line each."""
    return "\n".join(f"  {name:13} {fault.explains}" for name, fault in FAULTS.items())
