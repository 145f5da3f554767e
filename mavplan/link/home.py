"""Where the vehicle's home is: `HomeQuery` asks, `home_refusal` holds it against the mission's. No I/O.

A mission flown from another place than it was planned for is a wrong mission: every height is above home, and the
first leg begins there. The distance is a haversine on a sphere, 0.5 % off at worst: enough to tell another field from
this one.
"""

import math

from mavplan.errors import Problem, RefusedError
from mavplan.link.outbox import Outbox
from mavplan.link.protocol import (
    GROUND,
    HOME_POSITION_ID,
    REQUEST_MESSAGE,
    Address,
    Message,
    is_for,
    request_message,
    sender,
)
from mavplan.link.transfer import Pace
from mavplan.mission.model import HomePosition

ASK_AGAIN_S = 0.25
PATIENCE_S = 10.0
"""For a vehicle that says nothing to it at all: at half of all packets lost, a home is missed once in 10,000 times."""
NOES_BELIEVED = 16
"""Answers without a home behind them: the home itself may be lost on the way, but not so often."""
REFUSAL_COUNTS = 4
"""An answer that says that there is none to be had counts for so many."""
PATIENCE_SHARE = 1 / 3
"""Of the whole time that an upload has."""

MAX_HOME_DISTANCE_M = 500.0
MAX_HOME_HEIGHT_M = 30.0
EARTH_RADIUS_M = 6_371_008.8
"""Mean radius of WGS84 (IUGG R1)."""


class HomeQuery(Outbox):
    """Asks a vehicle for HOME_POSITION until it tells, or has said often enough that it cannot.

    Parameters
    ----------
    vehicle
        Its address.
    pace
        The link's round trip.
    now, deadline
        Start, and when to give up.
    asked_alone
        Nothing else is requested meanwhile, so that an answer to a request of ours is one to this.
    us
        Whose requests count.
    """

    def __init__(
        self,
        vehicle: Address,
        pace: Pace,
        *,
        now: float,
        deadline: float,
        asked_alone: bool = True,
        us: Address = GROUND,
    ) -> None:
        self.home: HomePosition | None = None
        self._vehicle = vehicle
        self._pace = pace
        self._deadline = deadline
        self._ask_at = now
        self._noes = 0
        self._counts_answers = asked_alone
        self._us = us
        super().__init__()
        self._over = False

    @property
    def done(self) -> bool:
        """Whether home is known, or not to be had."""
        return self._over or self.home is not None

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link."""
        del now
        if sender(message) != self._vehicle:
            return
        kind = message.get_type()
        if kind == "HOME_POSITION" and (message.latitude or message.longitude):
            self.home = HomePosition(message.latitude, message.longitude, message.altitude / 1000)
        elif kind != "COMMAND_ACK" or not self._counts_answers:
            return
        elif message.command == REQUEST_MESSAGE and is_for(message, self._us):
            self._noes += REFUSAL_COUNTS if message.result else 1

    def tick(self, now: float) -> None:
        """Ask again, or give up."""
        if self.done:
            return
        if now >= self._deadline or self._noes >= NOES_BELIEVED:
            self._over = True
        elif now >= self._ask_at:
            self._ask_at = now + max(ASK_AGAIN_S, self._pace.repeat_s)
            self._outbox.append(request_message(self._vehicle, HOME_POSITION_ID))

    def next_timer(self) -> float | None:
        """Time of the next `tick` that matters."""
        return None if self.done else min(self._ask_at, self._deadline)


def distance_m(one: HomePosition, other: HomePosition) -> float:
    """Return the distance over ground of two places on a sphere.

    References
    ----------
    R. W. Sinnott, "Virtues of the Haversine", Sky and Telescope 68(2), 1984.
    """
    lat1, lat2 = math.radians(one.lat_e7 / 1e7), math.radians(other.lat_e7 / 1e7)
    half_lon = math.radians((other.lon_e7 - one.lon_e7) / 1e7) / 2
    chord = math.sin((lat2 - lat1) / 2) ** 2 + math.cos(lat1) * math.cos(lat2) * math.sin(half_lon) ** 2
    return 2 * EARTH_RADIUS_M * math.asin(min(1.0, math.sqrt(chord)))


def home_refusal(
    planned: HomePosition,
    home: HomePosition,
    max_distance_m: float = MAX_HOME_DISTANCE_M,
    max_height_m: float = MAX_HOME_HEIGHT_M,
) -> RefusedError | None:
    """Return why a vehicle that stands here must not get this mission, or None."""
    away_m = distance_m(planned, home)
    higher_m = home.alt_amsl_m - planned.alt_amsl_m
    if away_m > max_distance_m:
        return RefusedError(
            f"the vehicle's home is {away_m:,.0f} m from the mission's, more than {max_distance_m:,.0f} m "
            "(--max-home-distance): nothing was sent; plan for where it stands"
        )
    if abs(higher_m) > max_height_m:
        side = "above" if higher_m > 0 else "below"
        return RefusedError(
            f"the vehicle's home is {abs(higher_m):,.0f} m {side} the mission's ({home.alt_amsl_m:,.0f} m and "
            f"{planned.alt_amsl_m:,.0f} m above sea level), more than {max_height_m:,.0f} m (--max-home-height): "
            "nothing was sent; plan for where it stands"
        )
    return None


def no_home_warning(max_distance_m: float) -> Problem:
    """Return what to say where the vehicle told no home."""
    found = (
        f"the vehicle has told none yet, so that it stands within {max_distance_m:,.0f} m of the mission's "
        "was not checked: look before you fly"
    )
    return Problem("home", found, "no-home", "warning")
