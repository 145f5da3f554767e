"""Finding the vehicle: whose heartbeat counts, which of several, and whether it is one to take a mission. No I/O."""

from dataclasses import dataclass
from typing import Literal

from mavplan.errors import InputError, MavplanError, NoLinkError, RefusedError, SilentLinkError
from mavplan.link.protocol import Address, Message, sender
from mavplan.mission.autopilots import AUTOPILOTS, AutopilotRules
from mavplan.mission.model import Autopilot

COLLECT_S = 1.5
"""Heartbeats come once a second: after the first, this long shows whether there is a second vehicle."""

NO_AUTOPILOT = 8
"""MAV_AUTOPILOT_INVALID: ground stations, cameras, gimbals."""

NOT_A_VEHICLE = frozenset({5, 6, 18, 26, 27, 30, 31, 32, 33, 34, 36, 37, 38, 39, 40, 41, 42, 44, 48})
"""MAV_TYPEs of trackers, ground stations and parts of a vehicle, some of which run an autopilot's software."""

MULTIROTORS = frozenset({2, 3, 13, 14, 15, 29, 35, 43})
"""MAV_TYPE: quadrotor, coaxial, hexa, octo, tri, dodeca, deca, any multirotor."""

_OTHER_TYPES = {
    0: "a vehicle of no stated kind",
    1: "a fixed wing",
    4: "a helicopter",
    10: "a ground rover",
    11: "a boat",
    12: "a submarine",
    **dict.fromkeys((19, 20, 21, 22, 23, 24, 25), "a VTOL plane"),
}
_OTHER_AUTOPILOTS = {0: "a generic autopilot", 1: "an unnamed autopilot"}


@dataclass(frozen=True, slots=True)
class Vehicle:
    """An autopilot that was heard.

    Attributes
    ----------
    address
        Its system and component.
    mav_autopilot, mav_type
        As its HEARTBEAT says.
    armed
        Whether its motors may turn.
    """

    address: Address
    mav_autopilot: int
    mav_type: int
    armed: bool

    @property
    def rules(self) -> AutopilotRules | None:
        """Its firmware, where it is one of ours."""
        return next(
            (rules for rules in AUTOPILOTS.values() if rules.mav_autopilot == self.mav_autopilot), None
        )

    @property
    def firmware(self) -> str:
        """Its firmware in words."""
        if self.rules is not None:
            return self.rules.title
        return _OTHER_AUTOPILOTS.get(self.mav_autopilot, f"autopilot {self.mav_autopilot}")


class Discovery:
    """Waits for an autopilot's heartbeat.

    Parameters
    ----------
    us
        Our own address; an echo of ours is no vehicle.
    system
        The system wanted; None takes the only one there is.
    place
        What to call the connection in a message.
    now, deadline
        Start, and when to give up.
    """

    def __init__(
        self,
        us: Address,
        system: int | None = None,
        place: str = "this connection",
        *,
        now: float,
        deadline: float,
    ) -> None:
        self._us = us
        self._system = system
        self._place = place
        self._now = now
        self._deadline = deadline
        self._decide_at: float | None = None
        self._seen: dict[Address, Vehicle] = {}
        self._others: set[str] = set()
        self.outcome: Vehicle | MavplanError | None = None

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link."""
        if self.outcome is not None or message.get_type() != "HEARTBEAT" or sender(message) == self._us:
            return
        address = sender(message)
        if message.autopilot == NO_AUTOPILOT or message.type in NOT_A_VEHICLE or address.system == 0:
            self._others.add("a ground station" if message.type == 6 else f"{address}, which is no autopilot")
            return
        vehicle = Vehicle(address, int(message.autopilot), int(message.type), bool(message.base_mode & 0x80))
        if self._system is not None and address.system != self._system:
            self._others.add(f"system {address.system}")
            return
        self._seen[address] = vehicle
        if self._decide_at is None:
            wait_s = COLLECT_S if self._system is None else 0.0
            self._decide_at = min(now + wait_s, self._deadline)

    def tick(self, now: float) -> None:
        """Decide when it is time."""
        if self.outcome is not None:
            return
        if self._decide_at is not None and now >= self._decide_at:
            self._decide()
        elif now >= self._deadline:
            heard = f"; heard were only {', '.join(sorted(self._others))}" if self._others else ""
            wanted = "an autopilot" if self._system is None else f"an autopilot of system {self._system}"
            self.outcome = (NoLinkError if self._others else SilentLinkError)(
                f"no heartbeat of {wanted} came over {self._place} within {self._deadline - self._now:g} s{heard}"
            )

    def next_timer(self) -> float | None:
        """Time of the next `tick` that matters."""
        if self.outcome is not None:
            return None
        return self._deadline if self._decide_at is None else self._decide_at

    def _decide(self) -> None:
        systems = sorted({address.system for address in self._seen})
        if len(systems) > 1:
            listed = ", ".join(str(system) for system in systems)
            self.outcome = InputError(
                f"several vehicles are on {self._place}: systems {listed}; say which is meant with --system"
            )
        else:
            self.outcome = self._seen[min(self._seen)]


def refusal(
    vehicle: Vehicle, wanted: Autopilot | None, purpose: Literal["upload", "download"] = "upload"
) -> RefusedError | None:
    """Return why this vehicle must not get (or give) a mission, or None. Nothing has been sent to it yet."""
    nothing = "nothing was sent" if purpose == "upload" else "nothing was fetched"
    if vehicle.rules is None:
        return RefusedError(
            f"{vehicle.address} runs {vehicle.firmware}; only ArduPilot and PX4 are known, so {nothing}"
        )
    if wanted is not None and vehicle.rules.name != wanted:
        title = AUTOPILOTS[wanted].title
        thing = "the mission is" if purpose == "upload" else "asked for was a mission"
        return RefusedError(f"{thing} for {title}, but {vehicle.address} runs {vehicle.firmware}; {nothing}")
    if vehicle.mav_type not in MULTIROTORS:
        kind = _OTHER_TYPES.get(vehicle.mav_type, f"a vehicle of MAV_TYPE {vehicle.mav_type}")
        return RefusedError(f"{vehicle.address} is {kind}, not a multirotor; {nothing}")
    return None
