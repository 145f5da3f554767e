"""Where a flight may end: whether it has come to where it stays, and how far from its end it came down. Pure."""

from collections.abc import Sequence

from mavplan.flight.route import Route
from mavplan.flight.telemetry import Position
from mavplan.link.home import distance_m
from mavplan.mission.model import HomePosition, Mission

FRESH_S = 5.0
WITHIN_M = 5.0
BELOW_M_S = 1.5
LASTS_S = 3.0
"""A vehicle that is so near, so slow and for so long stays there."""


class Staying:
    """Sees whether a vehicle has come to where it is to stay.

    Parameters
    ----------
    place
        Where that is.
    """

    def __init__(self, place: HomePosition) -> None:
        self._place = place
        self._since: float | None = None
        self._now = 0.0

    def see(self, position: Position | None, may_be: bool, now: float) -> None:
        """Take where the vehicle is, and whether it is at the item that lets it stay."""
        self._now = now
        near = (
            position is not None
            and now < position.at + FRESH_S
            and position.speed_m_s < BELOW_M_S
            and away_m(position, self._place) < WITHIN_M
        )
        if not (may_be and near):
            self._since = None
        elif self._since is None:
            self._since = now

    @property
    def stays(self) -> bool:
        """Whether it is there for good."""
        return self._since is not None and self._now >= self._since + LASTS_S


def away_m(position: Position, place: HomePosition) -> float:
    """Return how far over ground a vehicle is from a place."""
    return distance_m(HomePosition(position.lat_e7, position.lon_e7, 0.0), place)


def landed_off_m(
    position: Position | None, off_since: float | None, places: Sequence[HomePosition]
) -> float | None:
    """Return how far from the nearest of these places a vehicle came down.

    Parameters
    ----------
    position
        Where it was last seen.
    off_since
        When its motors were first heard not to turn any more.
    places
        Where the mission may end.

    Returns
    -------
    float or None
        Metres; None where it was not seen about that time.
    """
    if position is None or off_since is None or position.at < off_since - FRESH_S:
        return None
    return min((away_m(position, place) for place in places), default=None)


def ends_of(
    mission: Mission, route: Route, home: HomePosition | None, stood_at: Position | None
) -> list[HomePosition]:
    """Return where a mission may come down.

    Parameters
    ----------
    mission, route
        What is flown.
    home, stood_at
        The vehicle's home, and where it was when it was started: autopilots take home anew when they are armed.
    """
    if route.end != "rtl":
        return [route.end_place]
    found = [mission.home, *(HomePosition(point.lat_e7, point.lon_e7, 0.0) for point in mission.rally)]
    if home is not None:
        found.append(home)
    if stood_at is not None:
        found.append(HomePosition(stood_at.lat_e7, stood_at.lon_e7, 0.0))
    return found
