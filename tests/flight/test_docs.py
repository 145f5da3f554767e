"""The documentation's tables are those of the code."""

import re
from pathlib import Path

import pytest

from mavplan.errors import ExitCode
from mavplan.flight.phases import TRANSITIONS, IllegalFlightMoveError, Move, Phase, moved
from tests.flight.script import PX4_HOLD, begin, on_the_ground
from tests.link.harness import make_mission

DOCS = (Path(__file__).resolve().parents[2] / "docs/fly.md").read_text("utf-8")


def test_the_table_of_transitions_is_drawn_from_the_code():
    drawn = "\n".join(
        f"| {start.value} | {move.value} | {end.value} |" for (start, move), end in TRANSITIONS.items()
    )
    shown = re.search(
        r"<!-- transitions -->\n\|[^\n]*\n\|[^\n]*\n(.*)\n<!-- /transitions -->", DOCS, re.DOTALL
    )[1]
    assert shown == drawn


def test_every_phase_and_move_is_used_and_every_phase_can_end():
    assert {phase for pair in TRANSITIONS.items() for phase in (pair[0][0], pair[1])} == set(Phase)
    assert {move for _, move in TRANSITIONS} == set(Move)
    for phase in set(Phase) - {Phase.ENDED}:
        assert TRANSITIONS[phase, Move.EXPIRED] is Phase.ENDED


def test_nothing_arms_without_a_yes_by_the_table_alone():
    """Whatever leads to arming comes from APPROVED, and that only from READY."""
    approved = [pair for pair in TRANSITIONS if pair[1] is Move.APPROVED]
    assert approved == [(Phase.READY, Move.APPROVED)]
    reached, todo = set(), [Phase.CHECKING]
    while todo:
        phase = todo.pop()
        if phase not in reached:
            reached.add(phase)
            todo += [b for (a, move), b in TRANSITIONS.items() if a is phase and move is not Move.APPROVED]
    assert not reached & {Phase.REWINDING, Phase.SWITCHING, Phase.ARMING, Phase.STARTING}


def test_a_move_that_is_not_in_the_table_is_a_fault():
    with pytest.raises(IllegalFlightMoveError):
        moved(Phase.CHECKING, Move.APPROVED)


def test_the_exit_codes_are_the_codes():
    shown = {int(code) for code in re.findall(r"^\| (\d) \|", DOCS, re.MULTILINE)}
    assert shown == set(ExitCode) - {ExitCode.FAULT}


def test_the_lines_of_the_list_are_those_of_the_code():
    script = begin(make_mission("px4", 2))
    on_the_ground(script, "px4", PX4_HOLD, until=6.0)
    section = DOCS.partition("## The list before the start")[2].partition("\n## ")[0]
    shown = re.findall(r"^\| ([a-z ]+) \|", section, re.MULTILINE)
    assert shown[1:] == [check.name for check in script.session.checks]
