"""The error family: each kind has its documented exit code, and an input error carries all its problems."""

import pytest

from mavplan import errors
from mavplan.errors import ExitCode, InputError, MavplanError, Problem


@pytest.mark.parametrize(
    ("kind", "code"),
    [
        ("MavplanError", 1),
        ("InputError", 2),
        ("NoLinkError", 3),
        ("RefusedError", 4),
        ("UncertainError", 5),
        ("CheckError", 6),
    ],
)
def test_each_kind_has_the_exit_code_that_scripts_rely_on(kind, code):
    assert getattr(errors, kind)("what went wrong").exit_code == code
    assert issubclass(getattr(errors, kind), MavplanError)


def test_the_exit_codes_are_all_spoken_for():
    kinds = [
        kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, MavplanError)
    ]
    assert sorted({kind.exit_code for kind in kinds}) == [
        code for code in ExitCode if code is not ExitCode.DONE
    ]


def test_an_input_error_carries_every_problem_and_says_each():
    problems = [
        Problem("users.csv, line 2", "latitude 91 is beyond 90", "out-of-range"),
        Problem("", "no users", "empty"),
    ]
    error = InputError(iter(problems))
    assert error.problems == tuple(problems)
    assert str(error) == "users.csv, line 2: latitude 91 is beyond 90\nno users"
