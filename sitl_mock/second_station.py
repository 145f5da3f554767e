"""Another ground station on the same radio, without I/O: it reads the vehicle's mission, or writes one of its own."""

import math
from typing import Literal

from pymavlink.dialects.v20 import common as mavlink

from sitl_mock.wire import Encoder, Message, Parser

SYSTEM_ID, COMPONENT_ID = 254, 190
HEARTBEAT_PERIOD_S = 1.0
READ_PERIOD_S = 3.0
REPEAT_S = 1.0
UPLOAD_AFTER_S = 0.05
"""How long after somebody else's upload was accepted its own begins."""
LAT_E7, LON_E7 = 473977000, 85456000
ITEMS = ((22, 10.0, 0), (16, 20.0, 0), (16, 30.0, 500))
"""Command, altitude and northward offset (1e-7 degrees) of the items it writes."""


class SecondStation:
    """A station that downloads every few seconds (``read``) or writes once (``upload``).

    `receive` takes every frame the vehicle sends, to whomever; `to_send` gives what the station sends.
    """

    def __init__(self, doing: Literal["read", "upload"], vehicle_system_id: int) -> None:
        self._doing = doing
        self._vehicle = vehicle_system_id
        self._encoder = Encoder(SYSTEM_ID, COMPONENT_ID)
        self._parser = Parser()
        self._outbox: list[bytes] = []
        self._next_heartbeat = -math.inf
        self._next_start = math.inf if doing == "upload" else -math.inf
        self._uploads_left = 1
        self._uploading = False
        self._repeat_at = math.inf
        self._count = 0
        self._wanted = 0
        self._last: Message | None = None

    def receive(self, data: bytes, now: float) -> None:
        """Hear what the vehicle sends."""
        for message in self._parser.feed(data):
            name = message.get_type()
            for_me = getattr(message, "target_system", 0) == SYSTEM_ID
            if name == "MISSION_ACK" and not for_me and message.type == 0 and self._uploads_left:
                if self._doing == "upload" and message.mission_type == 0:
                    self._next_start = now + UPLOAD_AFTER_S
            elif for_me and name.startswith("MISSION_"):
                self._answer(name, message, now)

    def _answer(self, name: str, message: Message, now: float) -> None:
        if name == "MISSION_COUNT":
            self._count = message.count
            self._request(0, now)
        elif name in {"MISSION_ITEM_INT", "MISSION_ITEM"}:
            if message.seq == self._wanted:  # a second copy must not set off a second row of requests
                self._request(message.seq + 1, now)
        elif name in {"MISSION_REQUEST_INT", "MISSION_REQUEST"} and message.seq < len(ITEMS):
            self._send(self._item(message.seq), now)
        elif name == "MISSION_ACK" and (message.type == 0 or not self._uploading):
            self._last, self._repeat_at, self._uploading = None, math.inf, False

    def _request(self, seq: int, now: float) -> None:
        self._wanted = seq
        if seq < self._count:
            self._send(mavlink.MAVLink_mission_request_int_message(self._vehicle, 1, seq, 0), now)
        else:
            self._send(mavlink.MAVLink_mission_ack_message(self._vehicle, 1, 0, 0), now)
            self._last, self._repeat_at = None, math.inf

    def _item(self, seq: int) -> Message:
        command, alt_m, north_e7 = ITEMS[seq]
        return mavlink.MAVLink_mission_item_int_message(
            self._vehicle,
            1,
            seq,
            3,
            command,
            int(seq == 0),
            1,
            0,
            0,
            0,
            0,
            LAT_E7 + north_e7,
            LON_E7,
            alt_m,
            0,
        )

    def _send(self, message: Message, now: float) -> None:
        self._last, self._repeat_at = message, now + REPEAT_S
        self._outbox.append(self._encoder.encode(message))

    def tick(self, now: float) -> None:
        """Send what is due: heartbeats, the start of a transfer, a message that was not answered."""
        if now >= self._next_heartbeat:
            self._next_heartbeat = now + HEARTBEAT_PERIOD_S
            self._outbox.append(self._encoder.encode(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)))
        if now >= self._next_start:
            if self._doing == "upload":
                self._next_start, self._uploads_left, self._uploading = math.inf, self._uploads_left - 1, True
                self._send(mavlink.MAVLink_mission_count_message(self._vehicle, 1, len(ITEMS), 0), now)
            else:
                self._next_start = now + READ_PERIOD_S
                self._send(mavlink.MAVLink_mission_request_list_message(self._vehicle, 1, 0), now)
        elif self._last is not None and now >= self._repeat_at:
            self._send(self._last, now)

    def next_timer(self) -> float:
        """Return when `tick` has something to do."""
        return min(self._next_heartbeat, self._next_start, self._repeat_at)

    def to_send(self) -> list[bytes]:
        """Return the frames to send to the vehicle."""
        outbox, self._outbox = self._outbox, []
        return outbox
