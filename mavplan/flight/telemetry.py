"""What a vehicle tells of itself in flight, and since when: `Telemetry`. No I/O, no judgement.

Times are the caller's, in seconds, but for `VehicleClock`, the vehicle's own: a simulator's may run faster.
"""

import math
from collections import deque
from dataclasses import dataclass
from typing import Generic, TypeVar

from mavplan.link.protocol import Address, Message, opaque_id, sender

ARMED = 0x80
"""MAV_MODE_FLAG_SAFETY_ARMED."""
TWICE_S = 0.5
"""A changed value counts when it is told again so much later: one late frame changes nothing."""
CLOCK_SLIP_S = 3.0
"""A clock that jumps back by more began anew; less can be the link's reordering."""
SAME_TEXT_S = 3.0
WHOLE_TEXT_S = 0.3
"""After so long the parts of a text are together."""
RATE_AFTER_S = 5.0
"""So long a vehicle's clock is compared with ours before its pace is believed."""
KEPT_TEXTS = 100
NO_SEQ = 65_535
PREARM_CHECK = 0x1000_0000
"""MAV_SYS_STATUS_PREARM_CHECK."""
ON_GROUND = 1
AIRBORNE = frozenset({2, 3, 4})
"""MAV_LANDED_STATE: in the air, taking off, landing."""
AIRBORNE_ABOVE_M = 2.0
FIX_3D = 3
"""GPS_FIX_TYPE."""

Value = TypeVar("Value")


class Settled(Generic[Value]):
    """A value that changes when the change was told twice, `TWICE_S` apart; the first one counts at once."""

    def __init__(self) -> None:
        self.value: Value | None = None
        self.since: float = -math.inf
        self._next: Value | None = None
        self._next_at = 0.0

    def tell(self, value: Value, now: float) -> bool:
        """Take what was told; whether the settled value has changed."""
        if value == self.value:
            self._next = None
            return False
        if self.value is not None:
            if value != self._next:
                self._next, self._next_at = value, now
                return False
            if now < self._next_at + TWICE_S:
                return False
        self.value, self.since, self._next = value, now, None
        return True

    def take(self, value: Value, now: float) -> None:
        """Let a value count at once."""
        if value != self.value:
            self.value, self.since = value, now
        self._next = None


class VehicleClock:
    """The vehicle's own clock, from its ``time_boot_ms``; between two of them it goes on at its pace so far."""

    def __init__(self) -> None:
        self._boot_s: float | None = None
        self._heard_at = 0.0
        self._first: tuple[float, float] = (0.0, 0.0)

    def tell(self, boot_s: float, now: float) -> None:
        """Take a time of the vehicle's."""
        if self._boot_s is None or boot_s < self._boot_s - CLOCK_SLIP_S:
            self._first = (boot_s, now)
        elif boot_s <= self._boot_s:
            return
        self._boot_s, self._heard_at = boot_s, now

    def at(self, now: float) -> float:
        """Return its time, or ours where it tells none."""
        if self._boot_s is None:
            return now
        return self._boot_s + (now - self._heard_at) * self.pace

    @property
    def pace(self) -> float:
        """Its seconds in one of ours."""
        if self._boot_s is None or self._heard_at < self._first[1] + RATE_AFTER_S:
            return 1.0
        pace = (self._boot_s - self._first[0]) / (self._heard_at - self._first[1])
        return 1.0 if 0.8 < pace < 1.25 else pace


@dataclass(frozen=True, slots=True)
class Position:
    """GLOBAL_POSITION_INT: where it was, and when that was heard."""

    lat_e7: int
    lon_e7: int
    alt_amsl_m: float
    alt_rel_m: float
    speed_m_s: float
    at: float


@dataclass(frozen=True, slots=True)
class Battery:
    """What is left of the battery: ``percent`` None where the vehicle does not know it."""

    percent: int | None
    voltage_v: float | None
    at: float


@dataclass(frozen=True, slots=True)
class MissionCurrent:
    """MISSION_CURRENT: ``seq`` None where it names no item, ``total`` None where the firmware does not tell."""

    seq: int | None
    total: int | None
    state: int
    mission_id: int | None
    at: float


@dataclass(slots=True)
class Text:
    """A STATUSTEXT; its later parts are put behind it as they come."""

    severity: int
    words: str
    at: float


class Telemetry:
    """The last word of one vehicle on everything; None: it has not told.

    Parameters
    ----------
    vehicle
        Its address.
    """

    def __init__(self, vehicle: Address) -> None:
        self.vehicle = vehicle
        self.heard_at: float | None = None
        self.heartbeat_at: float | None = None
        self.armed_now = False
        """Of the last heartbeat."""
        self.mode_now: int | None = None
        self.base_mode = 0
        self.armed: Settled[bool] = Settled()
        self.mode: Settled[int] = Settled()
        self.landed: Settled[int] = Settled()
        self.on_ground_since: float | None = None
        """It says since then that it stands on the ground."""
        self.on_ground_at: float | None = None
        """When it said so last."""
        self.position: Position | None = None
        self.airborne_at: float | None = None
        """When it was last seen in the air."""
        self.battery: Battery | None = None
        self.mission: MissionCurrent | None = None
        self.fix: int | None = None
        self.ready_to_arm: bool | None = None
        self.texts: deque[Text] = deque(maxlen=KEPT_TEXTS)
        self.clock = VehicleClock()
        self._untold: list[Text] = []
        self._text_id = 0
        self._high = 0
        self._sys_status_knows = False

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link, whoever it is from."""
        if sender(message) != self.vehicle:
            return
        self.heard_at = now
        boot_ms = getattr(message, "time_boot_ms", None)
        if boot_ms is not None:
            self.clock.tell(float(boot_ms) / 1e3, now)
        match message.get_type():
            case "HEARTBEAT":
                self._on_heartbeat(message, now)
            case "GLOBAL_POSITION_INT":
                self._on_position(message, now)
            case "SYS_STATUS":
                self._on_sys_status(message, now)
            case "BATTERY_STATUS":
                self._on_battery_status(message, now)
            case "MISSION_CURRENT":
                self._on_mission_current(message, now)
            case "EXTENDED_SYS_STATE":
                self._on_landed_state(int(message.landed_state), now)
            case "GPS_RAW_INT":
                self.fix = int(message.fix_type)
            case "STATUSTEXT":
                self._on_text(message, now)

    @property
    def beat_at(self) -> float:
        """When the last heartbeat came; minus infinity: never."""
        return -math.inf if self.heartbeat_at is None else self.heartbeat_at

    def settle(self, now: float) -> None:
        """Let the last heartbeat count as it is."""
        if self.mode_now is not None:
            self.armed.take(self.armed_now, now)
            self.mode.take(self.mode_now, now)

    def new_texts(self, now: float) -> list[Text]:
        """Return the texts that are whole and were not returned before."""
        whole = [text for text in self._untold if now >= text.at + WHOLE_TEXT_S]
        self._untold = self._untold[len(whole) :]
        return whole

    def next_text_at(self) -> float | None:
        """Return when `new_texts` has the next one."""
        return self._untold[0].at + WHOLE_TEXT_S if self._untold else None

    def texts_since(self, since: float, worst: int = 7) -> list[str]:
        """Return the texts heard from a time on, of a severity and worse, each once, oldest first."""
        found = (text.words for text in self.texts if text.at >= since and text.severity <= worst)
        return list(dict.fromkeys(found))

    # -- the kinds --------------------------------------------------------------------------------------------

    def _on_heartbeat(self, message: Message, now: float) -> None:
        self.heartbeat_at = now
        self.base_mode = int(message.base_mode)
        self.armed_now = bool(self.base_mode & ARMED)
        self.mode_now = int(message.custom_mode)
        self.armed.tell(self.armed_now, now)
        self.mode.tell(self.mode_now, now)

    def _on_position(self, message: Message, now: float) -> None:
        speed_m_s = math.hypot(message.vx, message.vy, message.vz) / 100
        self.position = Position(
            int(message.lat),
            int(message.lon),
            message.alt / 1000,
            message.relative_alt / 1000,
            speed_m_s,
            now,
        )
        high = self.position.alt_rel_m > AIRBORNE_ABOVE_M
        self._high = self._high + 1 if high and self.armed_now else 0
        if self._high > 1:
            self.airborne_at = now

    def _on_landed_state(self, state: int, now: float) -> None:
        self.landed.tell(state, now)
        if self.landed.value in AIRBORNE:
            self.airborne_at = now
        if state != ON_GROUND:
            self.on_ground_since = None
        elif self.on_ground_since is None:
            self.on_ground_since = now
        self.on_ground_at = now if state == ON_GROUND else self.on_ground_at

    def _on_sys_status(self, message: Message, now: float) -> None:
        percent = int(message.battery_remaining)
        voltage_mv = int(message.voltage_battery)
        volts = voltage_mv / 1000 if 0 < voltage_mv < NO_SEQ else None
        self._sys_status_knows = 0 <= percent <= 100
        if self._sys_status_knows:
            self.battery = Battery(percent, volts, now)
        elif self.battery is None or self.battery.percent is None:
            self.battery = Battery(None, volts, now)
        told = message.onboard_control_sensors_present | message.onboard_control_sensors_enabled
        healthy = bool(message.onboard_control_sensors_health & PREARM_CHECK)
        self.ready_to_arm = healthy if healthy or told & PREARM_CHECK else None

    def _on_battery_status(self, message: Message, now: float) -> None:
        percent = int(message.battery_remaining)
        if message.id == 0 and 0 <= percent <= 100 and not self._sys_status_knows:
            self.battery = Battery(percent, self.battery.voltage_v if self.battery else None, now)

    def _on_mission_current(self, message: Message, now: float) -> None:
        seq, total = int(message.seq), int(message.total)
        self.mission = MissionCurrent(
            None if seq == NO_SEQ else seq,
            None if total in {0, NO_SEQ} else total,
            int(message.mission_state),
            opaque_id(message),
            now,
        )

    def _on_text(self, message: Message, now: float) -> None:
        words = str(message.text).replace("\0", "").rstrip("\t\r\n")
        if message.id and message.id == self._text_id and message.chunk_seq and self.texts:
            self.texts[-1].words += words
            return
        self._text_id = int(message.id)
        again = any(text.words == words and now < text.at + SAME_TEXT_S for text in self.texts)
        if words and not again:
            text = Text(int(message.severity), words, now)
            self.texts.append(text)
            self._untold.append(text)
