"""Whole flights of the mock over bad radios, with other people in them: no outcome is untrue, nothing is sent unasked.

Many more run by ``python -m tests.flight.test_bad_flights COUNT``.
"""

import itertools
import random
import sys
from collections import Counter
from dataclasses import dataclass

import pytest
from pymavlink.dialects.v20 import common

from mavplan.errors import CheckError, NoLinkError, RefusedError, UncertainError
from mavplan.flight.command import CommandLong
from mavplan.flight.launch import Launch
from mavplan.flight.manners import ARM, FLIGHT_MANNERS, START, set_mode
from mavplan.flight.orders import Order
from sitl_mock.flight.pilot import Setting
from tests.flight.harness import Air, Flown, Truth, fly, make_fly_session, say_yes
from tests.flight.script import Sent
from tests.link.harness import make_mission, make_network
from tests.link.script import VEHICLE

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
PILOT_MODE = {"ardupilot": 5, "px4": 3 << 16}
LINKS: dict[str, tuple[str, ...]] = {
    "drop": ("0.1", "0.3", "0.5"),
    "dup": ("0.3", "1"),
    "reorder": ("0.3",),
    "delay": ("100ms", "500ms"),
    "jitter": ("300ms",),
    "corrupt": ("0.02",),
}


@dataclass
class Case:
    """One flight."""

    firmware: str
    faults: str = ""
    seed: int = 0
    air: Air | None = None
    order: tuple[float, Order] | None = None
    stops: int = 1
    says_yes: bool = True

    def __str__(self) -> str:
        return f"{self.firmware} {self.faults!r} seed {self.seed} {self.air} {self.order}"

    @property
    def disturbed(self) -> bool:
        """Whether something happens that may end the flight otherwise."""
        named = ("reboot", "battery", "crash", "second-gcs")
        foreign = self.air is not None and bool(self.air.foreign)
        return foreign or self.order is not None or any(name in self.faults for name in named)


def run(case: Case) -> Flown:
    """Fly a case and hold what must always be so."""
    network = make_network(case.firmware, case.faults, case.seed)
    session = make_fly_session(make_mission(case.firmware, case.stops), network.clock_s)
    begin_s, ordered = network.clock_s, [case.order] if case.order else []

    def hands(session, now):
        if case.says_yes:
            say_yes(session, now)
        elif session.awaits_yes and now > begin_s + 60.0:
            session.decline()
        if ordered and now >= begin_s + ordered[0][0]:
            session.order(ordered.pop()[1], now)

    flown = fly(session, network, hands, case.air)
    faults = judged(case, flown)
    assert not faults, f"{case}: {faults}: {session.error!r}, {flown.doings}"
    return flown


def judged(case: Case, flown: Flown) -> list[str]:
    """Say what was sent that must not be, and what was said that is not true."""
    return [*sent_wrongly(case, flown), *said_wrongly(case, flown)]


def sent_wrongly(case: Case, flown: Flown) -> list[str]:
    wrong = []
    acting = [sent for sent in flown.sent if sent.words and not sent.words.startswith("MISSION_")]
    approved = flown.approved_at if flown.approved_at is not None else float("inf")
    if early := [sent.words for sent in acting if sent.at < approved]:
        wrong.append(f"sent before a yes: {early}")
    allowed = {"ARM 1 0", "REWIND 0", "REWIND 1"}
    modes = {"MODE 4"} if case.firmware == "ardupilot" else set()
    for sent in acting:
        if sent.words.startswith("START") or sent.words in allowed | modes:
            continue
        if case.order is None or sent.at < flown.session.started_at + case.order[0]:
            wrong.append(f"not asked for: {sent.words}")
    first_arming = min((s.at for s in acting if s.words.startswith(("ARM", "START"))), default=float("inf"))
    writes = [s for s in flown.sent if s.words.startswith(("MISSION_", "PARAM_SET", "REWIND"))]
    if late := [sent.words for sent in writes if sent.at > first_arming]:
        wrong.append(f"the mission was changed after the start: {late}")
    if case.firmware == "px4" and any(sent.words.startswith("ARM") for sent in acting):
        wrong.append("PX4 was armed by itself")
    # The heartbeat that shows it comes a second later at the latest, if it comes; five in a row are rarely lost.
    starts = [sent for sent in acting if sent.words.startswith("START")]
    if again := [
        s.words for s in starts if all(in_mission(case, t) for t in within(flown, s.at - 8.0, s.at))
    ]:
        wrong.append(f"started again in flight: {again}")
    return wrong


def in_mission(case: Case, truth: Truth) -> bool:
    return truth.armed and truth.mode == FLIGHT_MANNERS[case.firmware].mission_mode


def within(flown: Flown, begin: float, end: float) -> list[Truth]:
    """All that was true between two times."""
    before = [truth for truth in flown.truth if truth.at <= begin]
    return [*(before[-1:] or flown.truth[:1]), *(t for t in flown.truth if begin < t.at < end)]


def said_wrongly(case: Case, flown: Flown) -> list[str]:
    wrong, error = [], flown.session.error
    # A hop of a moment is no flight: the motors were stopped as it left the ground.
    flew = any(one.flying and other.at > one.at + 2.0 for one, other in itertools.pairwise(flown.truth))
    last = flown.truth[-1]
    manners = FLIGHT_MANNERS[case.firmware]
    if error is None:
        if last.armed or last.flying or not flew:
            wrong.append(f"called flown, but {last}")
        own = {manners.mission_mode, *manners.end_modes.get("rtl", ())}
        if not any(truth.finished for truth in flown.truth) and not reached_the_return(case, flown):
            wrong.append("called flown, but the mission was not finished")
        if last.mode not in own and not case.disturbed:
            wrong.append(f"called flown, but the last mode was {last.mode}")
    elif isinstance(error, RefusedError | NoLinkError):
        by_others = "somebody else has armed it" in str(error) or "is armed already" in str(error)
        if (flew or last.armed) and not by_others:
            wrong.append(f"said not to have been started, but {last}")
    elif isinstance(error, CheckError):
        if not case.disturbed:
            wrong.append("said to have ended otherwise, and nothing was in its way")
    elif not isinstance(error, UncertainError):
        wrong.append(f"ended with {error!r}")
    if error is not None and "\n" in str(error):
        wrong.append("more than one sentence")
    return wrong


def reached_the_return(case: Case, flown: Flown) -> bool:
    """Whether the vehicle was at the item that ends the mission."""
    last = flown.session.flight.route.end_seq
    return any(truth.seq == last and truth.flying for truth in flown.truth)


# -- the link ---------------------------------------------------------------------------------------------------


@BOTH
@pytest.mark.parametrize(
    ("faults", "seed"), [("drop=0.3", 1), ("dup=1,reorder=0.3,delay=400ms,jitter=300ms,drop=0.1", 2)]
)
def test_a_bad_link_only_makes_it_harder_to_see(firmware, faults, seed):
    flown = run(Case(firmware, faults, seed))
    assert flown.session.error is None
    assert flown.session.report.stops_done == (1,)


@BOTH
def test_lost_answers_start_nothing_twice(firmware):
    flown = run(Case(firmware, air=Air(lost_acks=1_000)))
    assert flown.session.error is None
    expected = ["MODE 4", "ARM 1 0", "START 0"] if firmware == "ardupilot" else ["START 0"]
    assert [words for words in flown.doings if not words.startswith("MISSION_")] == expected


@BOTH
def test_minutes_without_a_link_in_the_middle_are_told_and_change_nothing(firmware):
    flown = run(Case(firmware, air=Air(silent=[(30.0, 100.0)])))
    assert flown.session.error is None
    told = flown.told("link")
    assert told[0].startswith("nothing heard for 5 s; it flies on by itself")
    assert told[1].startswith("heard again after ")
    assert flown.session.report.unheard_s > 65.0


def test_a_link_that_is_gone_for_good_leaves_the_flight_alone_and_uncertain():
    flown = run(Case("px4", air=Air(silent=[(30.0, 1e9)])))
    assert isinstance(flown.session.error, UncertainError)
    assert flown.truth[-1].armed is False
    assert any(truth.finished for truth in flown.truth)


# -- other people, and failures ---------------------------------------------------------------------------------


@BOTH
def test_a_pilot_who_takes_over_is_told_of_and_never_fought(firmware):
    mode = set_mode(firmware, PILOT_MODE[firmware]).message(VEHICLE)
    back = set_mode(firmware, FLIGHT_MANNERS[firmware].return_mode).message(VEHICLE)
    flown = run(Case(firmware, "drop=0.2", air=Air(foreign=[(35.0, mode), (45.0, back)])))
    assert isinstance(flown.session.error, CheckError)
    assert len(flown.told("mode")) >= 1


@BOTH
def test_a_reboot_in_flight_is_told_of_and_messages_are_asked_for_anew(firmware):
    flown = run(Case(firmware, "reboot-at=40s"))
    assert isinstance(flown.session.error, CheckError)
    assert "the autopilot restarted at item" in str(flown.session.error)
    began_s = flown.session.started_at
    asked = [
        sent.at - began_s
        for sent in flown.sent
        if sent.message.get_type() == "COMMAND_LONG" and sent.message.command == 511
    ]
    assert any(at < 10.0 for at in asked)
    assert any(at > 41.0 for at in asked)


@BOTH
@pytest.mark.parametrize("order", Order)
def test_an_order_gets_through_a_bad_link(firmware, order):
    flown = run(Case(firmware, "drop=0.3", 5, order=(35.0, order)))
    manners = FLIGHT_MANNERS[firmware]
    wanted = manners.hold_modes[0] if order is Order.HOLD else manners.return_mode
    assert any(truth.mode == wanted and truth.flying for truth in flown.truth)
    if order is Order.RETURN:
        assert isinstance(flown.session.error, CheckError)
        assert "it was to return by your order" in str(flown.session.error)


@BOTH
@pytest.mark.parametrize(("battery_wh", "where"), [(3.6, "which is not the mission's"), (9.0, "")])
def test_a_battery_that_runs_low_is_no_flight_to_the_end(firmware, battery_wh, where):
    network = make_network(firmware, setting=Setting(battery_wh=battery_wh))
    flown = fly(make_fly_session(make_mission(firmware, 3), network.clock_s), network)
    assert isinstance(flown.session.error, CheckError)
    assert where in str(flown.session.error)
    assert "attery" in str(flown.session.error)
    assert flown.session.report.battery_after < 15


@BOTH
def test_without_a_yes_nothing_is_ever_armed(firmware):
    flown = run(Case(firmware, "drop=0.2", says_yes=False))
    assert not any(truth.armed for truth in flown.truth)
    assert isinstance(flown.session.error, RefusedError)


# -- the judge can find fault ----------------------------------------------------------------------------------


def test_a_client_that_repeats_blindly_is_found_out(monkeypatch):
    """Every quarter second another copy, whatever is heard of the vehicle."""

    def send(self, now, modes, *, armed):
        self.arming_sent = True
        self._outbox.append(self._called().send(now))

    good = run(Case("px4", air=Air(lost_acks=1_000)))
    sent_s = next(sent.at for sent in good.sent if sent.words == "START 0") - good.session.started_at
    silent = [(sent_s + 0.05, sent_s + 30.0)]
    case = Case("px4", air=Air(silent, lost_acks=1_000))
    assert [words for words in run(case).doings if words.startswith("START")] == ["START 0"]
    case.air.lost_acks = 1_000
    monkeypatch.setattr(Launch, "_send", send)
    monkeypatch.setattr("mavplan.flight.launch.GAP_S", 1e9)
    with pytest.raises(AssertionError, match="started again in flight"):
        run(case)


def test_a_client_that_calls_everything_flown_is_found_out(monkeypatch):
    monkeypatch.setattr("mavplan.flight.session.judge", lambda facts, left="": ("flown", None))
    with pytest.raises(AssertionError, match="called flown, but"):
        run(Case("px4", air=Air(silent=[(30.0, 1e9)]), order=(25.0, Order.HOLD)))


def test_a_client_that_calls_everything_refused_is_found_out(monkeypatch):
    refused = RefusedError("it was not started")
    monkeypatch.setattr("mavplan.flight.session.judge", lambda facts, left="": (str(refused), refused))
    with pytest.raises(AssertionError, match="said not to have been started"):
        run(Case("px4"))


def test_what_is_sent_before_a_yes_or_against_the_mission_is_found_out():
    case = Case("ardupilot")
    flown = run(case)
    flown.approved_at = None
    assert any("sent before a yes" in fault for fault in sent_wrongly(case, flown))
    count = common.MAVLink_mission_count_message(1, 1, 3, 0)
    flown.sent.append(Sent(flown.sent[-1].at, count))
    assert any("changed after the start: ['MISSION_COUNT']" in fault for fault in sent_wrongly(case, flown))
    flown.sent.append(Sent(flown.sent[-1].at, set_mode("ardupilot", 6).message(VEHICLE)))
    assert any("not asked for: MODE 6" in fault for fault in sent_wrongly(case, flown))
    flown.sent.append(Sent(flown.sent[-1].at, CommandLong(400, (1.0, 21196.0)).message(VEHICLE)))
    assert any("not asked for: ARM 1 21196" in fault for fault in sent_wrongly(case, flown))


# -- at random --------------------------------------------------------------------------------------------------


def random_case(chance: random.Random) -> Case:
    firmware = chance.choice(["ardupilot", "px4"])
    faults = {name: chance.choice(values) for name, values in LINKS.items() if chance.random() < 0.3}
    text = ",".join(f"{name}={value}" for name, value in faults.items())
    if chance.random() < 0.15:
        text += f",reboot-at={chance.randrange(5, 90)}s"
    if chance.random() < 0.1:
        text += ",second-gcs=read"
    if chance.random() < 0.1:
        text += chance.choice([",crash=3", ",gust=3/60m", ",position-lost=3/20s"])
    silent = [
        (begin, begin + chance.choice([3.0, 7.0, 12.0, 40.0, 200.0]))
        for begin in (chance.uniform(2.0, 90.0) for _ in range(chance.choice([0, 0, 1, 2])))
    ]
    foreign = []
    for _ in range(chance.choice([0, 0, 0, 1, 2])):
        what = chance.choice(
            [
                set_mode(firmware, PILOT_MODE[firmware]),
                set_mode(firmware, FLIGHT_MANNERS[firmware].return_mode),
                set_mode(firmware, FLIGHT_MANNERS[firmware].mission_mode),
                set_mode(firmware, FLIGHT_MANNERS[firmware].hold_modes[0]),
                ARM,
                START,
                CommandLong(400, (0.0,)),
            ]
        )
        foreign.append((chance.uniform(2.0, 120.0), what.message(VEHICLE)))
    order = (chance.uniform(8.0, 90.0), chance.choice(list(Order))) if chance.random() < 0.2 else None
    acks = chance.choice([0, 0, 1, 3, 1_000])
    return Case(firmware, text.lstrip(","), chance.randrange(10**6), Air(silent, acks, foreign), order)


@pytest.mark.parametrize("part", range(2))
def test_no_outcome_is_untrue_and_nothing_is_sent_unasked_whatever_goes_wrong(part):
    chance = random.Random(part)
    for _ in range(2):
        run(random_case(chance))


def main(count: int, first: int = 0) -> None:
    """Fly ``count`` random cases and print what came of them."""
    outcomes: Counter[str] = Counter()
    for number in range(first, first + count):
        case = random_case(random.Random(number))
        try:
            flown = run(case)
        except AssertionError as error:
            print(f"case {number}: {error}", flush=True)
            outcomes["WRONG"] += 1
            continue
        error = flown.session.error
        outcomes["flown" if error is None else type(error).__name__] += 1
    print(f"{count} flights: {dict(outcomes)}")


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:]) if len(sys.argv) > 1 else (100,))
