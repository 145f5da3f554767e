"""The documentation's tables are those of the code."""

import re
from pathlib import Path

from mavplan.errors import ExitCode
from mavplan.link.endpoint import parse_endpoint
from mavplan.link.transfer import TRANSITIONS, Move, State

DOCS = (Path(__file__).resolve().parents[2] / "docs/link.md").read_text("utf-8")


def test_the_table_of_transitions_is_drawn_from_the_code():
    drawn = "\n".join(
        f"| {start.value} | {move.value} | {end.value} |" for (start, move), end in TRANSITIONS.items()
    )
    shown = re.search(
        r"<!-- transitions -->\n\|[^\n]*\n\|[^\n]*\n(.*)\n<!-- /transitions -->", DOCS, re.DOTALL
    )[1]
    assert shown == drawn


def test_every_state_and_move_is_used_and_every_state_can_end():
    assert {state for pair in TRANSITIONS.items() for state in (pair[0][0], pair[1])} == set(State)
    assert {move for _, move in TRANSITIONS} == set(Move)
    for state in set(State) - {State.ENDED}:
        assert TRANSITIONS[state, Move.EXPIRED] is State.ENDED


def test_every_connection_string_shown_is_understood():
    shown = re.findall(r"`((?:udp|tcp|/dev|COM|serial:)[^`]*\d)`", DOCS)
    assert len(shown) >= 8
    for text in shown:
        parse_endpoint(text)


def test_the_exit_codes_are_the_codes():
    shown = {int(code) for code in re.findall(r"^\| (\d) \|", DOCS, re.MULTILINE)}
    assert shown == {
        ExitCode.DONE,
        ExitCode.BAD_INPUT,
        ExitCode.NO_LINK,
        ExitCode.REFUSED,
        ExitCode.UNCERTAIN,
        ExitCode.CHECK_FAILED,
    }
