"""The start, word by word: what is sent, when it is sent again, and when never."""

import pytest

from mavplan.errors import RefusedError, UncertainError
from mavplan.flight.phases import Phase
from tests.flight.script import (
    AUTO,
    GUIDED,
    LOITER,
    PX4_HOLD,
    PX4_MISSION,
    PX4_RETURN,
    acked,
    beat,
    begin,
    current,
    on_the_ground,
    position,
)
from tests.link.harness import HOME, make_mission
from tests.link.script import text

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
BEFORE = {"ardupilot": LOITER, "px4": PX4_HOLD}
SWITCH, ARM, START = 176, 400, 300
DENIED, FAILED, IN_PROGRESS = 2, 4, 5


def approved(firmware, *, seq=0, **options):
    """A session right after the yes, the mission at an item."""
    script = begin(make_mission(firmware, 2), **options)
    on_the_ground(script, firmware, BEFORE[firmware], until=6.0, seq=seq)
    assert script.session.phase is Phase.READY, script.session.error
    script.session.approve(script.now)
    script.hear(beat(firmware, BEFORE[firmware]), current(seq, 2))
    return script


def armed(**options):
    """ArduPilot, armed in GUIDED."""
    script = approved("ardupilot", **options)
    script.hear(acked(SWITCH), beat("ardupilot", GUIDED))
    quiet(script).hear(acked(ARM))
    return script


def quiet(script):
    """A copy of the mode or of the first item could come late: so long the start waits."""
    script.wait(script.now + 1.1)
    return script


def beats(script, firmware, mode, until, *, armed=False):
    """A heartbeat a second."""
    while script.now + 1.0 <= until and not script.session.done:
        script.hear_at(script.now + 1.0, beat(firmware, mode, armed=armed))


# -- all goes well ----------------------------------------------------------------------------------------------


def test_ardupilot_is_switched_armed_and_started_each_once():
    script = armed()
    script.hear_at(script.now + 0.1, acked(START))
    script.hear(beat("ardupilot", AUTO, armed=True))
    assert script.session.phase is Phase.FLYING
    assert script.doings == ["MODE 4", "ARM 1 0", "START 0"]


def test_nothing_arms_while_a_late_copy_of_the_mode_could_undo_it():
    script = approved("ardupilot")
    script.hear(acked(SWITCH), beat("ardupilot", GUIDED))
    script.wait(script.now + 0.9)
    assert script.doings == ["MODE 4"]
    script.wait(script.now + 0.2)
    assert script.doings == ["MODE 4", "ARM 1 0"]


def test_an_ardupilot_in_guided_is_not_switched():
    script = begin(make_mission("ardupilot", 2))
    on_the_ground(script, "ardupilot", GUIDED, until=6.0)
    script.session.approve(script.now)
    script.hear(beat("ardupilot", GUIDED), current(0, 2))
    assert script.doings == ["ARM 1 0"]


def test_px4_is_started_by_one_command():
    script = approved("px4")
    script.hear(acked(START))
    script.hear_at(script.now + 1.0, beat("px4", PX4_MISSION, armed=True))
    assert script.session.phase is Phase.FLYING
    assert script.doings == ["START 0"]


# -- answers are lost -------------------------------------------------------------------------------------------


@BOTH
def test_a_lost_answer_to_the_start_does_not_start_it_again(firmware):
    script = armed() if firmware == "ardupilot" else approved(firmware)
    mode = AUTO if firmware == "ardupilot" else PX4_MISSION
    beats(script, firmware, mode, script.now + 30.0, armed=True)
    assert script.session.phase is Phase.FLYING
    assert [words for words in script.doings if words.startswith("START")] == ["START 0"]


@BOTH
def test_a_start_that_was_lost_is_sent_again_with_its_confirmation_once_the_vehicle_shows_it(firmware):
    script = armed() if firmware == "ardupilot" else approved(firmware)
    before = GUIDED if firmware == "ardupilot" else PX4_HOLD
    sent_at = script.now
    script.hear_at(sent_at + 0.9, beat(firmware, before, armed=firmware == "ardupilot"))
    assert script.doings[-1] == "START 0"
    script.hear_at(sent_at + 1.9, beat(firmware, before, armed=firmware == "ardupilot"))
    assert script.doings[-1] == "START 1"
    script.hear(acked(START))
    script.hear_at(
        sent_at + 2.9, beat(firmware, AUTO if firmware == "ardupilot" else PX4_MISSION, armed=True)
    )
    assert script.session.phase is Phase.FLYING


def test_lost_answers_to_mode_and_arming_are_made_up_for_by_the_heartbeat():
    script = approved("ardupilot")
    beats(script, "ardupilot", GUIDED, script.now + 2.0)
    beats(script, "ardupilot", GUIDED, script.now + 1.0, armed=True)
    assert script.doings == ["MODE 4", "ARM 1 0", "START 0"]


@BOTH
def test_nothing_is_repeated_while_the_vehicle_is_not_heard(firmware):
    script = armed() if firmware == "ardupilot" else approved(firmware)
    sent = len(script.doings)
    script.wait(script.now + 100.0)
    assert len(script.doings) == sent


@BOTH
def test_after_a_silence_in_which_it_may_have_flown_nothing_is_repeated_either(firmware):
    script = armed() if firmware == "ardupilot" else approved(firmware)
    sent = len(script.doings)
    script.wait(script.now + 60.0)
    beats(script, firmware, BEFORE[firmware], script.now + 60.0)
    assert len(script.doings) == sent
    assert isinstance(script.session.error, UncertainError)
    assert "whether it took off is not known" in str(script.session.error)


def test_px4_that_says_in_progress_is_given_time_and_then_asked_again():
    script = approved("px4")
    sent_at = script.now
    script.hear_at(sent_at + 0.5, acked(START, IN_PROGRESS))
    beats(script, "px4", PX4_HOLD, sent_at + 6.0)
    assert script.doings == ["START 0"]
    beats(script, "px4", PX4_HOLD, sent_at + 9.0)
    assert script.doings == ["START 0", "START 1"]


# -- refusals ---------------------------------------------------------------------------------------------------


def test_an_ardupilot_that_refuses_to_arm_is_asked_until_it_does():
    script = approved("ardupilot")
    script.hear(acked(SWITCH), beat("ardupilot", GUIDED))
    quiet(script)
    for _ in range(5):
        script.hear(acked(ARM, FAILED), text("Arm: GPS 1: Bad fix"))
        beats(script, "ardupilot", GUIDED, script.now + 3.0)
    script.hear(acked(ARM))
    assert script.session.phase is Phase.STARTING
    assert script.doings == ["MODE 4", *["ARM 1 0"] * 6, "START 0"]
    assert all(sent.message.confirmation == 0 for sent in script.sent if sent.words.startswith("ARM"))


def test_an_ardupilot_that_does_not_arm_in_time_is_refused_with_its_own_reason():
    script = approved("ardupilot", arm_s=20.0)
    script.hear(acked(SWITCH), beat("ardupilot", GUIDED))
    quiet(script)
    until = script.now + 40.0
    while script.now < until and not script.session.done:
        script.hear(acked(ARM, FAILED), text("Arm: Battery 1 low"))
        beats(script, "ardupilot", GUIDED, script.now + 2.0)
    assert isinstance(script.session.error, RefusedError)
    assert str(script.session.error) == (
        "it did not arm within 20 s ('Arm: Battery 1 low'): it was not started"
    )
    assert "START 0" not in script.doings


def test_a_mode_that_is_refused_ends_it_without_arming():
    script = approved("ardupilot")
    until = script.now + 30.0
    while script.now < until and not script.session.done:
        script.hear(acked(SWITCH, FAILED), text("Mode change to GUIDED failed: requires position"))
        beats(script, "ardupilot", LOITER, script.now + 1.0)
    assert "did not switch to GUIDED ('Mode change to GUIDED failed: requires position')" in str(
        script.session.error
    )
    assert isinstance(script.session.error, RefusedError)
    assert set(script.doings) == {"MODE 4"}


def test_a_px4_that_denies_the_start_is_refused_with_its_answer():
    script = approved("px4", arm_s=10.0)
    until = script.now + 30.0
    while script.now < until and not script.session.done:
        script.hear(acked(START, DENIED))
        beats(script, "px4", PX4_HOLD, script.now + 2.0)
    assert isinstance(script.session.error, RefusedError)
    assert "(it answered denied (COMMAND_ACK 2))" in str(script.session.error)


def test_an_ardupilot_that_refuses_the_start_and_disarms_is_told_to_have_stayed_on_the_ground():
    script = armed()
    for _ in range(5):
        script.hear(acked(START, FAILED), text("Auto: Missing Takeoff Cmd"))
        beats(script, "ardupilot", GUIDED, script.now + 2.0, armed=True)
    beats(script, "ardupilot", GUIDED, script.now + 20.0)
    assert isinstance(script.session.error, RefusedError)
    assert "it was disarmed before the mission was started ('Auto: Missing Takeoff Cmd')" in str(
        script.session.error
    )


def test_an_auto_that_never_takes_off_and_disarms_was_not_started():
    script = armed()
    script.hear(acked(START), beat("ardupilot", AUTO, armed=True), position(HOME))
    beats(script, "ardupilot", AUTO, script.now + 10.0, armed=True)
    beats(script, "ardupilot", AUTO, script.now + 10.0)
    assert isinstance(script.session.error, RefusedError)
    assert str(script.session.error) == "it did not take off, and its motors do not turn any more"


def test_a_px4_that_accepts_and_is_not_armed_is_not_known_to_be_safe():
    script = approved("px4")
    script.hear(acked(START))
    beats(script, "px4", PX4_HOLD, script.now + 60.0)
    assert isinstance(script.session.error, RefusedError | UncertainError)
    assert script.doings == ["START 0"]


def test_a_px4_that_was_armed_by_the_start_and_is_not_any_more_is_not_started_again():
    """Another station has put it on hold on the ground, where it disarms by itself; the answer was lost."""
    script = approved("px4")
    sent_at = script.now
    beats(script, "px4", PX4_HOLD, sent_at + 4.0, armed=True)
    beats(script, "px4", PX4_HOLD, sent_at + 40.0)
    assert script.doings == ["START 0"]
    assert isinstance(script.session.error, RefusedError)
    assert "it was armed and is not any more" in str(script.session.error)


def test_a_px4_that_stays_armed_without_flying_its_mission_is_watched_and_not_started_again():
    script = approved("px4")
    beats(script, "px4", PX4_HOLD, script.now + 20.0, armed=True)
    assert script.session.phase is Phase.FLYING
    assert script.doings == ["START 0"]
    assert script.told("start") == [
        "it is armed and does not fly its mission, in HOLD: what becomes of it is watched"
    ]


# -- somebody else ----------------------------------------------------------------------------------------------


@BOTH
def test_a_mode_that_somebody_else_chooses_before_the_arming_ends_the_start(firmware):
    script = begin(make_mission(firmware, 2))
    on_the_ground(script, firmware, BEFORE[firmware], until=6.0)
    script.session.approve(script.now)
    other = 2 if firmware == "ardupilot" else PX4_RETURN
    beats(script, firmware, other, script.now + 3.0)
    script.hear(current(0, 2))
    beats(script, firmware, other, script.now + 30.0)
    assert isinstance(script.session.error, RefusedError)
    assert "somebody else switched it to" in str(script.session.error)
    assert script.doings == []


def test_a_pilot_who_takes_an_armed_vehicle_is_not_fought():
    script = approved("ardupilot")
    script.hear(acked(SWITCH), beat("ardupilot", GUIDED))
    quiet(script)
    beats(script, "ardupilot", LOITER, script.now + 1.0, armed=True)
    sent = len(script.doings)
    beats(script, "ardupilot", LOITER, script.now + 60.0, armed=True)
    assert script.doings[sent:] == []
    assert script.session.phase is Phase.FLYING
    assert "somebody else switched it to LOITER: what becomes of it is watched" in script.told("start")


@BOTH
def test_a_vehicle_that_somebody_arms_after_the_yes_is_left_alone(firmware):
    script = begin(make_mission(firmware, 2))
    on_the_ground(script, firmware, BEFORE[firmware], until=6.0)
    script.session.approve(script.now)
    script.hear(beat(firmware, BEFORE[firmware], armed=True), current(0, 2))
    script.wait(script.now + 5.0)
    assert "somebody else has armed it" in str(script.session.error)
    assert script.doings == []


@BOTH
def test_an_autopilot_that_restarts_in_the_start_is_not_started_any_more(firmware):
    script = approved(firmware)
    sent = list(script.doings)
    script.hear_at(script.now + 1.0, position(HOME, boot_s=50.0))
    script.hear_at(script.now + 1.0, position(HOME, boot_s=0.5))
    for _ in range(30):
        script.hear(current(0, 2))
        beats(script, firmware, BEFORE[firmware], script.now + 1.0)
    assert isinstance(script.session.error, RefusedError)
    assert "the autopilot has restarted" in str(script.session.error)
    assert script.doings == sent


@BOTH
def test_an_interrupted_start_sends_nothing_more(firmware):
    script = begin(make_mission(firmware, 2))
    on_the_ground(script, firmware, BEFORE[firmware], until=6.0)
    script.session.approve(script.now)
    script.session.break_off("you interrupted the start")
    beats(script, firmware, BEFORE[firmware], script.now + 30.0)
    assert isinstance(script.session.error, RefusedError)
    assert "you interrupted the start" in str(script.session.error)
    assert script.doings == []


@BOTH
def test_a_start_interrupted_after_its_command_is_watched_if_it_flies(firmware):
    script = armed() if firmware == "ardupilot" else approved(firmware)
    script.session.break_off("you interrupted the start")
    sent = len(script.doings)
    beats(script, firmware, AUTO if firmware == "ardupilot" else PX4_MISSION, script.now + 5.0, armed=True)
    assert script.session.phase is Phase.FLYING
    assert script.doings[sent:] == []


# -- the first item ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("firmware", "first"), [("ardupilot", 1), ("px4", 0)])
def test_a_mission_that_stands_at_a_later_item_is_set_to_the_first_and_that_is_said(firmware, first):
    script = approved(firmware, seq=4)
    assert script.doings == [f"REWIND {first}"]
    for _ in range(3):
        script.hear_at(script.now + 1.1, beat(firmware, BEFORE[firmware]))
        script.hear(current(4, 2))
    assert script.doings == [f"REWIND {first}"] * 4
    script.hear(current(first, 2))
    assert script.doings[4:] == (["MODE 4"] if firmware == "ardupilot" else [])
    quiet(script)
    assert script.doings[4:] == ["MODE 4" if firmware == "ardupilot" else "START 0"]
    assert script.told("start") == [f"the mission stood at item 4: set back to item {first}"]


@BOTH
def test_a_mission_that_does_not_let_itself_be_set_back_is_not_started(firmware):
    script = approved(firmware, seq=4)
    for _ in range(30):
        script.hear_at(script.now + 1.0, beat(firmware, BEFORE[firmware]))
        script.hear(current(4, 2))
    assert "would start at item 4 and does not let itself be set to the first" in str(script.session.error)
    assert not [words for words in script.doings if not words.startswith("REWIND")]


@BOTH
def test_where_the_mission_stands_must_be_told_after_the_yes(firmware):
    script = begin(make_mission(firmware, 2))
    on_the_ground(script, firmware, BEFORE[firmware], until=6.0)
    script.session.approve(script.now)
    beats(script, firmware, BEFORE[firmware], script.now + 30.0)
    assert "does not tell at which item it would start" in str(script.session.error)
    assert script.doings == []
