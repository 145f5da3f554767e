"""Reading a few parameters of a vehicle by name: asks until they are told or time is over. No I/O.

https://mavlink.io/en/services/parameter.html. A vehicle stays silent about a name that it does not know.
"""

import struct
from collections.abc import Sequence

from mavplan.link.outbox import Outbox
from mavplan.link.protocol import Address, Message, param_request_read, payload_of, sender
from mavplan.link.transfer import Pace

ASK_AGAIN_S = 0.4
ASKED_IN_VAIN = 4
"""So often a name that not every version has is asked for, after which the vehicle has not got it."""

_BYTEWISE = {1: "<B", 2: "<b", 3: "<H", 4: "<h", 5: "<I", 6: "<i", 9: "<f"}
"""MAV_PARAM_TYPE: how the first bytes of the value field are to be read where they travel bytewise."""


class ParameterQuery(Outbox):
    """Asks for parameters by name.

    Parameters
    ----------
    vehicle
        Its address.
    needed
        Names to be asked for until they are told.
    optional
        Names that the vehicle may not have.
    bytewise
        Integers travel as their own bytes in the float field (PX4), not as a float (ArduPilot).
    pace
        The link's round trip.
    now, deadline
        Start, and when to give up.
    """

    def __init__(
        self,
        vehicle: Address,
        needed: Sequence[str],
        optional: Sequence[str],
        *,
        bytewise: bool,
        pace: Pace,
        now: float,
        deadline: float,
    ) -> None:
        self.values: dict[str, float] = {}
        self._vehicle = vehicle
        self._needed = tuple(needed)
        self._asked = dict.fromkeys((*needed, *optional), 0)
        self._bytewise = bytewise
        self._pace = pace
        self._deadline = deadline
        self._ask_at = now
        self._over = False
        super().__init__()

    @property
    def done(self) -> bool:
        """Whether all is known that is to be had."""
        return self._over or len(self.values) == len(self._asked)

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link."""
        del now
        if message.get_type() != "PARAM_VALUE" or sender(message) != self._vehicle:
            return
        name = str(message.param_id).split("\0", 1)[0]
        if name in self._asked:
            self.values[name] = self._value(message)

    def _value(self, message: Message) -> float:
        layout = _BYTEWISE.get(message.param_type)
        if not self._bytewise or layout is None:
            return float(message.param_value)
        # From the frame, for a float on its way through Python may not keep the bits of every integer.
        raw = payload_of(message)[:4].ljust(4, b"\0")
        (value,) = struct.unpack_from(layout, raw)
        return float(value)

    def tick(self, now: float) -> None:
        """Ask again for what is missing, or give up."""
        if self.done:
            return
        if now >= self._deadline:
            self._over = True
        elif now >= self._ask_at:
            missing = [name for name in self._asked if name not in self.values]
            wanted = [n for n in missing if n in self._needed or self._asked[n] < ASKED_IN_VAIN]
            if not wanted:
                self._over = True
                return
            self._ask_at = now + max(ASK_AGAIN_S, self._pace.repeat_s)
            for name in wanted:
                self._asked[name] += 1
                self._outbox.append(param_request_read(self._vehicle, name))

    def next_timer(self) -> float | None:
        """Time of the next `tick` that matters."""
        return None if self.done else min(self._ask_at, self._deadline)
