"""Both recorded flights played to a session: it starts them as they were, follows them, and ends as they ended."""

from pathlib import Path

import pytest

from mavplan.flight.phases import Phase
from mavplan.link.codec import Codec
from mavplan.link.protocol import received_item
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.model import HomePosition
from mavplan.mission.wire import from_wire
from tests.flight.script import (
    PX4_HOLD,
    PX4_MISSION,
    PX4_RETURN,
    beat,
    begin,
    current,
    on_the_ground,
    position,
)
from tests.link.recordings import frames_of

CAPTURES = Path(__file__).resolve().parents[2] / "../shared/captures"
pytestmark = pytest.mark.skipif(
    not CAPTURES.is_dir(), reason="the recordings of real autopilots are not here"
)
HOME = HomePosition(374_000_000, -1_221_000_000, 10.0)
STABILIZE = 0


# The recordings of PX4 hold only every fifth or tenth heartbeat; its texts say when they changed.
CHANGES = {
    "Armed by mission start": (PX4_MISSION, True),
    "Returning to launch": (PX4_RETURN, True),
    "Disarmed by landing": (PX4_RETURN, False),
}


def recording(name):
    """The vehicle's messages with their times, and the mission that was flown."""
    heard, items = [], {}
    for at, frame in frames_of(CAPTURES / f"{name}.tlog"):
        for message in Codec().decode(frame, 0.0):
            if message.get_srcSystem() == 1:
                heard.append((at, message))
            elif message.get_type() == "MISSION_ITEM_INT":
                items[message.seq] = received_item(message)
    rules = AUTOPILOTS["px4" if name.startswith("px4") else "ardupilot"]
    mission, _ = from_wire([items[seq] for seq in sorted(items)], rules, HOME)
    if rules.name == "px4":
        heard = with_every_heartbeat(heard)
    return heard, mission


def with_every_heartbeat(heard):
    """A heartbeat a second, in the state that the recorded texts tell."""
    texts = [(at, m.text.strip()) for at, m in heard if m.get_type() == "STATUSTEXT"]
    changes = [(at, CHANGES[text]) for at, text in texts if text in CHANGES]
    assert len(changes) == len(CHANGES)
    last = int(heard[-1][0]) + 6
    beats = []
    for second in range(last):
        told = [state for at, state in changes if at <= second + 0.9]
        mode, armed = told[-1] if told else (PX4_HOLD, False)
        beats.append((second + 0.9, beat("px4", mode, armed=armed)))
    return sorted((*beats, *((at, m) for at, m in heard if m.get_type() != "HEARTBEAT")), key=lambda p: p[0])


def started(name, start_s):
    """A script that has its yes, and its start asked for, just before the recorded start."""
    heard, mission = recording(name)
    script = begin(mission, now=start_s - 20.0, users=[("Ann",), ("Bob", "Cy"), ("Di",)])
    mode = STABILIZE if mission.autopilot == "ardupilot" else PX4_HOLD
    began_s = next(m.time_boot_ms / 1000 - at for at, m in heard if m.get_type() == "GLOBAL_POSITION_INT")
    on_the_ground(
        script,
        mission.autopilot,
        mode,
        until=start_s - 1.4,
        position=position(HOME, boot_s=began_s + start_s - 2.0),
    )
    assert script.session.phase is Phase.READY, script.session.error
    assert script.doings == []
    script.session.approve(script.now)
    script.hear(current(0, 2), beat(mission.autopilot, mode))
    return script, [(at, message) for at, message in heard if at > start_s - 0.4]


def play(script, heard):
    """Play the rest, and keep a picture of every second."""
    pictures = {}
    for at, message in heard:
        script.hear_at(at, message)
        if script.session.done:
            break
        pictures[int(at)] = script.session.picture(at)
    script.wait(script.now + 20.0)
    return pictures


def test_ardupilots_flight_is_started_followed_and_ends_flown():
    script, heard = started("ardupilot_flight_loiter", 0.0)
    pictures = play(script, heard)
    report = script.session.report
    assert script.session.error is None
    assert (report.outcome, report.words) == ("flown", "flown to its end, landed, motors off")
    assert script.doings == ["MODE 4", "ARM 1 0", "START 0"]
    assert (report.items_done, report.items) == (7, 7)
    assert (report.stops_done, report.users_served) == ((1, 2, 3), ("Ann", "Bob", "Cy", "Di"))
    assert report.flight_s == pytest.approx(187.6, abs=1.2)  # seen by heartbeats
    assert [picture.current for at, picture in pictures.items() if at in {10, 30, 45, 60, 100, 130}] == [
        1, 2, 3, 4, 6, 7,
    ]  # fmt: skip
    # The hold is 40.89 to 48.90; the second one is only seen to begin by its place.
    assert pictures[44].hold_left_s == pytest.approx(8.0 - (44.5 - 40.89), abs=1.5)
    assert pictures[30].hold_left_s is None
    assert pictures[74].hold_left_s == pytest.approx(79.2 - 74.5, abs=3.0)
    assert [picture.users_served for at, picture in pictures.items() if at in {40, 60, 100, 150}] == [
        0,
        1,
        3,
        4,
    ]
    assert script.told("mode") == []
    assert script.told("stop") == [
        "stop 1 of 3: holds 8 s for Ann",
        "stop 1 of 3 done",
        "stop 2 of 3: holds 8 s for Bob, Cy",
        "stop 2 of 3 done",
        "stop 3 of 3: holds 8 s for Di",
        "stop 3 of 3 done",
    ]


@pytest.mark.parametrize("name", ["px4_flight", "px4_flight_full"])
def test_px4s_flight_is_started_followed_and_ends_flown(name):
    start_s = 12.43 if name == "px4_flight" else 13.23
    script, heard = started(name, start_s)
    pictures = play(script, heard)
    report = script.session.report
    assert (report.outcome, report.words) == ("flown", "flown to its end, landed, motors off")
    assert script.doings == ["START 0"]
    assert (report.items_done, report.items) == (7, 7)
    assert (report.stops_done, report.users_served) == ((1, 2, 3), ("Ann", "Bob", "Cy", "Di"))
    assert {pictures[at].current for at in (20, 50, 90, 120)} <= {0, 1, 2, 3}
    assert pictures[160].current == 5
    assert script.told("mode") == ["RETURN: the mission leads there"]
    # On the vehicle's own clock, which the simulation let run slower than the recording's.
    clock = {at: m.time_boot_ms / 1000 for at, m in heard if m.get_type() == "GLOBAL_POSITION_INT"}
    begun, ended = (min(clock, key=lambda at: abs(at - when)) for when in (start_s, heard[-1][0] - 5.0))
    assert report.flight_s == pytest.approx(clock[ended] - clock[begun], abs=2.0)
    assert report.flight_s == pytest.approx(script.session.route.mission_s, rel=0.05)
    assert report.battery_after == 51
