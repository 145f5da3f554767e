"""How a flight ended, judged from what was heard of it: `judge`. Pure.

0 only where it is known that every item was flown and the vehicle came down, or stays, as the mission has it. What
was not heard is not known, and that is said (exit code 5) unless the vehicle itself tells it afterwards.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from mavplan.errors import CheckError, MavplanError, RefusedError, UncertainError
from mavplan.flight.telemetry import Text

LANDED_WITHIN_M = 25.0
"""Autopilots come down within a few metres of where they are to."""
CRITICAL, WARNING = 2, 4
"""MAV_SEVERITY."""


@dataclass(frozen=True, slots=True)
class Facts:
    """What is known of a flight when it is over, or is left.

    Attributes
    ----------
    complete
        Every item before its end was flown.
    airborne
        It was seen in the air.
    disarmed
        Its motors do not turn any more.
    stays
        It is where it is to stay.
    mode
        The mode it was last in while armed.
    own_mode
        That mode is the mission's own.
    heard
        It was heard just now.
    landed_off_m
        How far from where the mission ends it was last seen, once its motors had stopped; None: not known.
    ordered
        What the user ordered and got, or empty.
    replaced
        The vehicle flew another mission than the one verified.
    meddled
        Another station wrote to its mission meanwhile.
    skipped
        Stops that somebody made it pass over.
    restarted
        The autopilot restarted in flight.
    unheard_at_end
        It was not heard between being armed in its mission and being found not armed.
    where
        Item and stop, in words.
    known
        The last words of the vehicle on its state and their age, in words.
    reason
        Why nothing more was asked for in a start that was broken off, or empty.
    texts
        What the vehicle said since the start.
    """

    complete: bool
    airborne: bool
    disarmed: bool
    stays: bool
    mode: str
    own_mode: bool
    heard: bool
    landed_off_m: float | None
    ordered: str
    replaced: bool
    meddled: bool
    skipped: tuple[int, ...]
    restarted: bool
    unheard_at_end: bool
    where: str
    known: str
    reason: str
    texts: Sequence[Text] = ()


def judge(facts: Facts, left: str = "") -> tuple[str, MavplanError | None]:  # noqa: PLR0911 - one return a case
    """Return the sentence on a flight, and the error where it was not flown to its end.

    Parameters
    ----------
    facts
        What is known.
    left
        Why it is not watched any longer although it is not over; empty: it is over.
    """
    if left and not (facts.disarmed and facts.complete):
        return _left(facts, left)
    if facts.replaced:
        return _otherwise("another mission was put on the vehicle while it flew: it flew that one", facts)
    if facts.skipped:
        stops = ", ".join(str(number) for number in facts.skipped)
        return _otherwise(
            f"the hold was not kept at stop {stops}: the mission went on before its time", facts
        )
    if facts.stays:
        return _flown("flown to its last stop, where it stays until somebody takes over", facts)
    if not facts.airborne and not facts.complete:
        return _on_ground(facts)
    if facts.restarted and not facts.complete:
        return _otherwise(f"the autopilot restarted {facts.where}", facts)
    if facts.unheard_at_end and not facts.complete and facts.own_mode:
        return _uncertain(
            f"it was not heard for a while {facts.where}, and now its motors do not turn: how it came down is not "
            f"known; {facts.known}",
            facts,
        )
    if facts.ordered:
        return _otherwise(f"it was to {facts.ordered} by your order, {facts.where}", facts)
    if not facts.own_mode:
        when = "at the mission's end" if facts.complete else facts.where
        return _otherwise(f"it came down in {facts.mode}, which is not the mission's, {when}", facts)
    if not facts.complete:
        return _otherwise(f"its motors stopped in {facts.mode}, {facts.where}", facts)
    if facts.landed_off_m is not None and facts.landed_off_m > LANDED_WITHIN_M:
        return _otherwise(f"it came down {facts.landed_off_m:,.0f} m from where the mission ends", facts)
    if not facts.disarmed:
        return _flown("flown to its end and landed; it has not stopped its motors: keep away", facts)
    return _flown("flown to its end, landed, motors off", facts)


def _on_ground(facts: Facts) -> tuple[str, MavplanError]:
    """Say what is known of a vehicle that was never seen in the air."""
    why = f"{facts.reason}; " if facts.reason else ""
    if facts.restarted:
        why = f"{why}the autopilot restarted; "
    if facts.unheard_at_end or not facts.disarmed:
        return _uncertain(f"{why}whether it took off is not known; {facts.known}", facts)
    words = f"{why}it did not take off, and its motors do not turn any more{_said(facts)}"
    return words, RefusedError(words)


def _left(facts: Facts, left: str) -> tuple[str, MavplanError]:
    """Say what is known of a vehicle that is not watched any longer."""
    if facts.ordered:
        return _otherwise(
            f"{left}: it was to {facts.ordered} by your order, {facts.where}; {facts.known}", facts
        )
    if facts.heard and not facts.own_mode and not facts.reason:
        return _otherwise(f"{left}: it is in {facts.mode}, which is not the mission's; {facts.known}", facts)
    what = f"{facts.reason}; nothing more was sent"
    if not facts.reason:
        what = "its mission was left alone, and it flies on by itself"
    return _uncertain(f"{left}: {what}; it was {facts.where}; {facts.known}", facts)


def _flown(words: str, facts: Facts) -> tuple[str, MavplanError | None]:
    if facts.meddled:
        return _uncertain(f"{words}; but another ground station wrote to its mission meanwhile", facts)
    return f"{words}{_said(facts, CRITICAL)}", None


def _otherwise(words: str, facts: Facts) -> tuple[str, MavplanError]:
    words = f"{words}{_said(facts)}"
    return words, CheckError(words)


def _uncertain(words: str, facts: Facts) -> tuple[str, MavplanError]:
    words = f"{words}{_said(facts)}"
    return words, UncertainError(words)


def _said(facts: Facts, worst: int = WARNING) -> str:
    """Return what the vehicle said of a severity and worse."""
    bad = list(dict.fromkeys(text.words for text in facts.texts if text.severity <= worst))
    return f"; it said {'; '.join(repr(words) for words in bad[-4:])}" if bad else ""
