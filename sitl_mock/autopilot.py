"""A mock autopilot without I/O: bytes in, bytes out, time as an argument.

It takes what ground stations send over any number of links, answers as its firmware was measured to answer, and
says when it wants to be called again. Sockets are in `endpoint`, a bad radio in `network`.
"""

import math
from collections import deque
from collections.abc import Hashable
from dataclasses import replace

from pymavlink.dialects.v20 import common as mavlink

from sitl_mock import commands
from sitl_mock.ardupilot_missions import ArduPilotMissions
from sitl_mock.firmware import Firmware
from sitl_mock.flight.ardupilot_mission import ArduPilotMissionPilot
from sitl_mock.flight.battery import NOMINAL_V
from sitl_mock.flight.pilot import Pilot, Setting
from sitl_mock.flight.px4_mission import Px4MissionPilot
from sitl_mock.items import MissionType, StoredItem, VehicleKilledError
from sitl_mock.mission_wire import item_of
from sitl_mock.missions import SEVERITY_INFO, MissionKeeper, Partner, Reply, Text
from sitl_mock.parameters import Parameters
from sitl_mock.px4_missions import Px4Missions
from sitl_mock.telemetry import DATA_STREAMS, Schedule, Telemetry
from sitl_mock.vehicle import Home, Landed, VehicleState
from sitl_mock.voice import Voice
from sitl_mock.wire import Encoder, Message, Parser, Signing

HEARTBEAT_PERIOD_S = 1.0
REBOOT_SILENCE_S = 1.0
MISSION_COMPONENTS = frozenset({0, 1, 190})
COMPONENTS = frozenset({0, 1})
MIN_PERIOD_S = 0.02


class Autopilot:
    """One vehicle: call `receive` with what came and `tick` when `next_timer` says; take what `to_send` gives.

    Parameters
    ----------
    firmware
        `firmware.ARDUPILOT` or `firmware.PX4`.
    system_id, component_id
        MAVLink ids of the vehicle.
    home
        Latitude and longitude in degrees and metres above mean sea level; None: no home yet.
    boot_time_s
        Seconds from the first call until the vehicle is ready; by default it is up already.
    capacity
        Greatest number of mission items taken (ArduPilot's with home), in place of the firmware's.
    item_pace_s
        Time from a message to its answer; `firmware.item_pace_s` is as measured.
    telemetry
        Send the firmware's own streams; without, only HEARTBEAT and MISSION_CURRENT come unasked.
    setting
        Wind, battery, mass, faults and seed of the flight.
    signing
        From `sitl_mock.signing.make_signing`: everything is signed, and only what is signed with the key is heard.
    speed
        How many times as fast as its partners' the vehicle's time goes: their heartbeats count for longer by its clock.

    Raises
    ------
    ValueError
        If home or an id is no such thing.
    """

    def __init__(
        self,
        firmware: Firmware,
        *,
        system_id: int = 1,
        component_id: int = 1,
        home: tuple[float, float, float] | None = None,
        boot_time_s: float = 0.0,
        capacity: int | None = None,
        item_pace_s: float = 0.0,
        telemetry: bool = True,
        setting: Setting | None = None,
        signing: Signing = None,
        speed: float = 1.0,
    ) -> None:
        if not (1 <= system_id <= 255 and 1 <= component_id <= 255):
            raise ValueError(f"system {system_id} and component {component_id} must be 1 to 255")
        if capacity is not None and not 0 <= capacity <= 65535:
            raise ValueError(f"capacity {capacity} must be 0 to 65535")
        self.firmware = firmware
        self.system_id = system_id
        self.component_id = component_id
        self.killed_by: str | None = None
        self.vehicle = VehicleState.on_ground(firmware, None if home is None else Home.from_degrees(*home))
        self.vehicle.ready = boot_time_s <= 0
        self._boot_time_s = boot_time_s
        self._pace_s = item_pace_s
        room = dict(firmware.capacity)
        if capacity is not None:
            room[MissionType.MISSION] = capacity
        keeper = ArduPilotMissions if firmware.name == "ardupilot" else Px4Missions
        self._missions: MissionKeeper = keeper(firmware, self.vehicle, room)
        self._parameters = Parameters(firmware)
        self._setting = setting or Setting()
        if firmware.name == "ardupilot" and self._setting.battery_wh > 0:
            capacity_mah = self._setting.battery_wh / NOMINAL_V * 1000
            self._parameters.put("BATT_CAPACITY", round(capacity_mah))
            self._parameters.put("BATT_LOW_MAH", capacity_mah / 10)
        self.pilot = self._new_pilot(self._setting)
        self._modes_told = 0
        self._telemetry = Telemetry(firmware, self.vehicle, system_id)
        streams = {
            name: period
            for name, period in firmware.streams.items()
            if telemetry or name == "MISSION_CURRENT"
        }
        self._schedule = Schedule(streams)
        self.signing = signing
        self._voice = Voice(firmware, Encoder(system_id, component_id, signing), self._schedule, speed)
        self._parsers: dict[Hashable, Parser] = {}
        self._inbox: deque[tuple[float, Hashable, Message]] = deque()
        self._started: float | None = None
        self._silent_until = -math.inf
        self._next_heartbeat = -math.inf

    def _new_pilot(self, setting: Setting, standing_e7: tuple[int, int] | None = None) -> Pilot:
        pilot = ArduPilotMissionPilot if self.firmware.name == "ardupilot" else Px4MissionPilot
        return pilot(self.firmware, self.vehicle, self._missions, self._parameters, setting, standing_e7)

    # What a driver calls

    def receive(self, data: bytes, sender: Hashable, now: float) -> None:
        """Take bytes that came from `sender`, which names a link: a UDP address, a TCP connection."""
        self.tick(now)
        if self.killed_by is not None or now < self._silent_until:
            return
        for message in self._parsers.setdefault(sender, Parser(self.signing)).feed(data):
            if self._pace_s > 0:
                self._inbox.append((now + self._pace_s, sender, message))
            else:
                self._handle(sender, message, now)

    def tick(self, now: float) -> None:
        """Do whatever is due by now."""
        if self._started is None:
            self._started = now
            self._next_heartbeat = now
            self.pilot.begin(now)
        if self.killed_by is not None or now < self._silent_until:
            return
        if not self.vehicle.ready and now >= self._started + self._boot_time_s:
            self.vehicle.ready = True
            if self.firmware.name == "ardupilot":
                self._reply([Text(SEVERITY_INFO, "ArduPilot Ready")], now)
        while self._inbox and self._inbox[0][0] <= now:
            due, sender, message = self._inbox.popleft()
            self._handle(sender, message, due)
        if now >= self.pilot.due:
            self.pilot.tick(now)
            self._speak_for_pilot(now)
        if now >= self._voice.due:
            self._voice.repeat(now)
        if now >= self._next_heartbeat:
            on_time = self._next_heartbeat + HEARTBEAT_PERIOD_S
            self._next_heartbeat = on_time if on_time > now else now + HEARTBEAT_PERIOD_S
            self._send_heartbeat()
        replies = self._missions.tick(now)
        if replies:
            self._reply(replies, now)
        if now >= self._schedule.due:
            for link, name in self._schedule.take(now):
                self._send_telemetry(link, name, now)

    def to_send(self) -> list[tuple[Hashable | None, bytes]]:
        """Return the frames to send and to whom, in order; None means every peer there is."""
        return self._voice.take()

    def next_timer(self) -> float | None:
        """Return when `tick` must be called at the latest; None before its first call and once the vehicle is dead."""
        if self.killed_by is not None or self._started is None:
            return None
        due = min(self._next_heartbeat, self.pilot.due, self._voice.due, self._schedule.due)
        if not self.vehicle.ready:
            due = min(due, self._started + self._boot_time_s)
        if self._inbox:
            due = min(due, self._inbox[0][0])
        missions = self._missions.next_timer()
        if missions is not None:
            due = min(due, missions)
        return max(due, self._silent_until)

    def stored(self, mission_type: int = MissionType.MISSION) -> tuple[StoredItem, ...]:
        """Return a list as it reads back: ArduPilot's mission with home as item 0."""
        return tuple(self._missions.stored(mission_type))

    def forget(self, link: Hashable) -> None:
        """Drop a link that is gone."""
        self._parsers.pop(link, None)
        self._voice.forget(link)
        self._schedule.forget(link)
        self._missions.forget(link)

    def reboot(self, now: float) -> None:
        """Lose everything but the stored lists and home, say nothing for a second, then boot; fall if in the air."""
        self._missions.reboot()
        vehicle, here = self.vehicle, self.pilot.sample(now)
        vehicle.armed = vehicle.mission_running = vehicle.in_mission_mode = vehicle.flying = False
        vehicle.landed = Landed.ON_GROUND
        setting = replace(self._setting, armable_s=self.firmware.armable_s)
        self.pilot = self._new_pilot(setting, None if here is None else (here.lat_e7, here.lon_e7))
        self._modes_told = vehicle.mode_changes
        self.vehicle.base_mode, self.vehicle.custom_mode = self.firmware.base_mode, self.firmware.custom_mode
        self.vehicle.ready = False
        for link in self._schedule.links():
            self._schedule.forget(link)
        self._parsers.clear()
        self._inbox.clear()
        self._voice.reboot()
        self._silent_until = now + REBOOT_SILENCE_S
        self._started = self._next_heartbeat = self._silent_until
        self.pilot.begin(self._silent_until)
        self._boot_time_s = self.firmware.boot_s

    # What messages do

    def _handle(self, link: Hashable, message: Message, now: float) -> None:
        sender = Partner(link, message.get_srcSystem(), message.get_srcComponent())
        if self.killed_by is not None or (sender.system, sender.component) == (
            self.system_id,
            self.component_id,
        ):
            return
        self._schedule.greet(link, now)
        name = message.get_type()
        try:
            if name.startswith("MISSION_"):
                self._reply(self._mission(sender, name, message, now), now)
                self.pilot.mission_changed(now)
                self._speak_for_pilot(now)
            elif name in {"COMMAND_LONG", "COMMAND_INT"}:
                self._command(sender, message, now)
            else:
                self._other(sender, name, message, now)
        except VehicleKilledError as killed:
            self.killed_by = str(killed)
            self._voice.fall_silent()
            self._inbox.clear()

    def _for_me(self, message: Message, components: frozenset[int]) -> bool:
        to_all = message.target_system == 0 and self.firmware.old_system_zero
        return (to_all or message.target_system == self.system_id) and (
            message.target_component in components or message.target_component == self.component_id
        )

    def _mission(  # noqa: PLR0911 - one return a message
        self, sender: Partner, name: str, message: Message, now: float
    ) -> list[Reply]:
        if not hasattr(message, "target_system") or not self._for_me(message, MISSION_COMPONENTS):
            return []
        kind = getattr(message, "mission_type", int(MissionType.MISSION))
        missions = self._missions
        match name:
            case "MISSION_COUNT":
                return missions.on_count(sender, message.count, kind, now)
            case "MISSION_ITEM_INT" | "MISSION_ITEM":
                as_int = name == "MISSION_ITEM_INT"
                return missions.on_item(sender, item_of(message, as_int=as_int), kind, now, as_int=as_int)
            case "MISSION_REQUEST_INT" | "MISSION_REQUEST":
                return missions.on_request(
                    sender, message.seq, kind, now, as_int=name == "MISSION_REQUEST_INT"
                )
            case "MISSION_REQUEST_LIST":
                return missions.on_request_list(sender, kind, now)
            case "MISSION_ACK":
                return missions.on_ack(sender, message.type, kind, now)
            case "MISSION_CLEAR_ALL":
                return missions.on_clear_all(sender, kind, now)
            case "MISSION_SET_CURRENT":
                replies = missions.on_set_current(sender, message.seq, now)
                self.pilot.set_current(message.seq, now)
                return replies
        return []

    def _command(self, sender: Partner, message: Message, now: float) -> None:
        if message.target_system not in {0, self.system_id} or message.target_component not in {
            0,
            self.component_id,
        }:
            return
        if message.command not in commands.ABOUT_MESSAGES:
            for result in commands.carry_out(commands.order_of(message), now, self.pilot):
                self._voice.acknowledge(sender, message.command, result)
            self._speak_for_pilot(now)
            return
        params = (message.param1, message.param2, message.param3, message.param4)
        outcome = commands.execute(message.command, params, sender.link, now, self._telemetry, self._schedule)
        self._voice.acknowledge(sender, message.command, outcome.result)
        for answer in outcome.messages:
            self._voice.say(sender.link, answer)
        for name in outcome.telemetry:
            self._send_telemetry(sender.link, name, now)

    def _other(self, sender: Partner, name: str, message: Message, now: float) -> None:
        if name == "HEARTBEAT":
            if self._voice.hear_station(sender.link, now) and self.firmware.sends_events:
                self._voice.say(sender.link, self._voice.events.current())
        elif name == "TIMESYNC":
            if message.tc1 == 0:
                ours = int(self._uptime_s(now) * 1e9)
                self._voice.say(sender.link, mavlink.MAVLink_timesync_message(ours, message.ts1))
        elif name == "PING":
            if self.firmware.answers_ping and message.target_system == 0:
                echo = (message.time_usec, message.seq, sender.system, sender.component)
                self._voice.say(sender.link, mavlink.MAVLink_ping_message(*echo))
        elif name == "SET_MODE":
            if message.target_system in {0, self.system_id}:
                self.pilot.set_mode(message.custom_mode, now)
                self._speak_for_pilot(now)
        elif hasattr(message, "target_system") and self._for_me(message, COMPONENTS):
            self._addressed(sender, name, message, now)

    def _addressed(self, sender: Partner, name: str, message: Message, now: float) -> None:
        """Answer what only the vehicle it is addressed to answers."""
        answers: list[Message] = []
        match name:
            case "REQUEST_EVENT":
                if self.firmware.sends_events:
                    asked = (message.first_sequence, message.last_sequence)
                    answers = [*self._voice.events.answer(*asked, sender.system, sender.component)]
            case "PARAM_REQUEST_LIST":
                answers = self._parameters.all()
            case "PARAM_REQUEST_READ":
                answers = self._parameters.read(message.param_id, message.param_index)
            case "PARAM_SET":
                answers = self._parameters.set(message.param_id, message.param_value)
            case "REQUEST_DATA_STREAM":
                self._data_stream(sender, message, now)
        for answer in answers:
            self._voice.say(sender.link, answer)

    def _data_stream(self, sender: Partner, message: Message, now: float) -> None:
        if self.firmware.name != "ardupilot":
            return
        on = message.start_stop and message.req_message_rate
        period_s = max(1.0 / message.req_message_rate, MIN_PERIOD_S) if on else -1.0
        for stream in DATA_STREAMS.get(message.req_stream_id, ()):
            self._schedule.set_period(sender.link, stream, period_s, now)

    # What goes out

    def _uptime_s(self, now: float) -> float:
        return max(0.0, now - (now if self._started is None else self._started))

    def _send_telemetry(self, link: Hashable, name: str, now: float) -> None:
        if name == "CURRENT_EVENT_SEQUENCE":
            self._voice.say(link, self._voice.events.current())
            return
        known = self._telemetry.message(name, self._uptime_s(now), now, self._missions, self.pilot)
        if known is not None:
            self._voice.say(link, *known)

    def _send_heartbeat(self) -> None:
        self._voice.say(None, self._telemetry.heartbeat())

    def _reply(self, replies: list[Reply], now: float) -> None:
        self._voice.reply(replies, now, self._uptime_s(now))

    def _speak_for_pilot(self, now: float) -> None:
        if self._modes_told != self.vehicle.mode_changes:
            self._modes_told = self.vehicle.mode_changes
            if self.firmware.mode_heartbeat:
                self._send_heartbeat()
        said = self.pilot.said()
        if said:
            self._reply(said, now)
