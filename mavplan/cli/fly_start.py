"""When a flight is to start: at a time of the clock, a vehicle of a fleet so much later than its first."""

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Any

import click

from mavplan.cli.console import clock, stopwatch

if TYPE_CHECKING:
    from mavplan.part import Part

LATE_S = 3.0
"""A start that is later than this is none any more: the vehicles would come closer than planned."""

RENEW_S = 20.0
"""So long before the start what the vehicle holds is verified again, so that the start need not wait for that."""


class ClockTime(click.ParamType[datetime]):
    """A time of the clock, ``14:30`` or ``14:30:00``, or with a date as ISO 8601 has it."""

    name = "TIME"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> datetime:
        """Return the moment, with a zone."""
        if isinstance(value, datetime):
            return value
        try:
            return moment(str(value), datetime.now().astimezone())
        except ValueError:
            example = "14:30, 14:30:00, or 2025-08-18T14:30:00+02:00"
            self.fail(f"{value!r} is no time of the clock; write {example}", param, ctx)


def moment(text: str, now: datetime) -> datetime:
    """Return the moment that a text means: a time without a date is the nearest one, in the zone of now.

    Raises
    ------
    ValueError
        It is no time.
    """
    text = text.strip()
    if ":" in text and "-" not in text and "+" not in text and "T" not in text.upper():
        if text.count(":") not in (1, 2):
            raise ValueError(text)
        shape = "%H:%M" if text.count(":") == 1 else "%H:%M:%S"
        of_day = datetime.strptime(text, shape).time()
        today = datetime.combine(now.date(), of_day, now.tzinfo)
        return min(
            (today + timedelta(days=days) for days in (-1, 0, 1)),
            key=lambda at: abs((at - now).total_seconds()),
        )
    found = datetime.fromisoformat(text)
    if "T" not in text.upper() and ":" not in text:
        raise ValueError(text)
    return found if found.tzinfo is not None else found.replace(tzinfo=now.tzinfo)


@dataclass(frozen=True, slots=True)
class Start:
    """When a vehicle starts.

    Attributes
    ----------
    at
        The moment, with a zone.
    """

    at: datetime

    def wait_s(self, now_s: float) -> float:
        """Return the seconds until then, negative when it is over; ``now_s`` since 1970."""
        return self.at.timestamp() - now_s

    def is_late(self, now_s: float) -> bool:
        """Return whether it is too late for it."""
        return self.wait_s(now_s) < -LATE_S

    def late_words(self, now_s: float) -> str:
        """Return why it is not started any more."""
        late = clock(-self.wait_s(now_s))
        return f"it was to start at {self.at:%H:%M:%S}, {late} ago, and others may be on its way"

    def count_down(self, now_s: float) -> str:
        """Return the line that is shown until then."""
        left = stopwatch(max(self.wait_s(now_s), 0.0))
        return f"starts at {self.at:%H:%M:%S}, in {left}; Ctrl-C: it stays on the ground"


def start_of(part: "Part | None", at: datetime | None) -> Start | None:
    """Return when a plan's vehicle starts; None where nobody said when the first one, or it, does."""
    if at is None:
        return None
    return Start(at + timedelta(seconds=0.0 if part is None else part.start_s))


def is_one_of_a_fleet(part: "Part | None") -> bool:
    """Return whether other vehicles fly at the same time."""
    return part is not None and part.kind == "vehicle" and part.of > 1


def turn_words(part: "Part") -> str:
    """Return when a vehicle of a fleet starts, as a clause that begins with a verb."""
    which, of_it = f"is vehicle {part.number} of {part.of}", ""
    if part.rounds > 1:
        which, of_it = f"{which} in round {part.round} of {part.rounds}", " of this round"
    if part.start_s <= 0:
        return f"{which}, and starts first or together with the first{of_it}"
    return f"{which}, and starts {clock(part.start_s)} after the first{of_it}"
