"""JSON files: what is written is what is read, laid out for people."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.json_layout import laid_out

LEAVES = (
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text()
)
VALUES = st.recursive(
    LEAVES, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=20
)


@given(document=st.dictionaries(st.text(), VALUES))
def test_what_is_written_is_read_again(document):
    assert json.loads(laid_out(document)) == document


def test_members_and_records_have_a_line_each():
    text = laid_out(
        {"stops": [{"hold_s": 1.5, "users": ["ä"]}, {"hold_s": 2}], "bound": {"gap": None}, "asked": [1, 2]}
    )
    assert text.splitlines() == [
        "{",
        '  "stops": [',
        '    {"hold_s": 1.5, "users": ["ä"]},',
        '    {"hold_s": 2}',
        "  ],",
        '  "bound": {',
        '    "gap": null',
        "  },",
        '  "asked": [1, 2]',
        "}",
    ]


def test_numbers_that_json_does_not_know_are_refused_unless_allowed():
    with pytest.raises(ValueError, match="JSON"):
        laid_out({"hold_s": float("nan")})
    assert "NaN" in laid_out({"hold_s": float("nan")}, allow_nan=True)
