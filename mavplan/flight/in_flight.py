"""A vehicle in flight: it is watched, its texts are told, the user's orders are sent. No I/O."""

from mavplan.flight.manners import FlightManners
from mavplan.flight.orders import Order, OrderCall
from mavplan.flight.telemetry import Telemetry
from mavplan.flight.watching import Happened, Watching
from mavplan.link.outbox import Outbox
from mavplan.link.protocol import Address, Message
from mavplan.link.transfer import Pace
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.build import End

WORST_TOLD = 5
"""MAV_SEVERITY of the texts that are told to people: notices and worse."""


class InFlight(Outbox):
    """One flight from its start on.

    Parameters
    ----------
    watching
        Who watches it.
    rules, manners
        The firmware.
    end
        How the mission ends.
    us, telemetry, pace
        Our address; what is known of the vehicle and of the link. Others feed them.
    since
        When the start began: earlier texts do not belong to the flight.
    """

    def __init__(
        self,
        watching: Watching,
        rules: AutopilotRules,
        manners: FlightManners,
        end: End,
        *,
        us: Address,
        telemetry: Telemetry,
        pace: Pace,
        since: float,
    ) -> None:
        self.watching = watching
        self._since = since
        self._rules, self._manners, self._end = rules, manners, end
        self._us, self._telemetry, self._pace = us, telemetry, pace
        self._order: OrderCall | None = None
        super().__init__()

    def order(self, order: Order) -> None:
        """Take an order of the user's; it takes the place of the one before."""
        own = {self._manners.mission_mode, *self.watching.order_modes, self._telemetry.mode.value}
        own |= self._manners.end_modes.get(self._end, frozenset())
        self._order = OrderCall(
            order,
            self._rules.name,
            self._manners,
            frozenset(own),
            vehicle=self._telemetry.vehicle,
            us=self._us,
            telemetry=self._telemetry,
            pace=self._pace,
        )

    @property
    def ordered(self) -> str:
        """What was ordered and is not yet done, or empty."""
        return self._order.order.value if self._order is not None and not self._order.done else ""

    @property
    def follows_an_order(self) -> bool:
        """Whether the vehicle does what was ordered, and not its mission."""
        watching = self.watching
        return watching.ordered != "" and self._telemetry.mode_now in watching.order_modes

    @property
    def followed(self) -> str:
        """The order that it follows in place of its mission, or empty."""
        return self.watching.ordered if self.follows_an_order else ""

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link."""
        if self._order is not None:
            self._order.receive(message, now)

    def tick(self, now: float) -> list[Happened]:
        """Let time pass; what has happened."""
        texts = self._telemetry.new_texts(now)
        told = [
            Happened("text", repr(text.words), text.at)
            for text in texts
            if text.severity <= WORST_TOLD and text.at >= self._since
        ]
        return [*self._on_order(now), *told, *self.watching.tick(now)]

    def next_timer(self) -> float | None:
        """Time of the next `tick` that matters."""
        return self._order.next_timer() if self._order is not None else None

    def _on_order(self, now: float) -> list[Happened]:
        order = self._order
        if order is None:
            return []
        order.tick(now)
        self._outbox += order.to_send()
        if order.granted_mode is not None:
            self.watching.ordered = order.order.value
            self.watching.order_modes |= {order.granted_mode}
        words, order.words = order.words, []
        return [Happened("order", told) for told in words]
