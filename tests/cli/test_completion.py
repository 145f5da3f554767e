"""Shells complete what there is: driven in bash as bash drives it."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from mavplan.cli.kinds import PLANNER_NAMES

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def completed(tmp_path, mavplan):
    """Give to a line what bash would offer at its end, and the options that were set for it."""
    tools, desk = tmp_path / "bin", tmp_path / "desk"
    tools.mkdir()
    desk.mkdir()
    (tools / "mavplan").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m mavplan "$@"\n')
    (tools / "mavplan").chmod(0o755)
    (desk / "completion").write_text(mavplan("completion", "bash").out)
    environment = {**os.environ, "PATH": f"{tools}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}

    def complete(*words):
        script = (
            "compopt() { echo \"OPTION $2\"; }\n. ./completion\ncomplete -p mavplan | sed 's/^/SET /'\n"
            f'COMP_WORDS=("$@"); COMP_CWORD={len(words) - 1}\n'
            '_mavplan_completion mavplan "${@: -1}"\nprintf "%s\\n" "${COMPREPLY[@]}"\n'
        )
        done = subprocess.run(
            ["bash", "--norc", "-c", script, "bash", *words],
            cwd=desk,
            env=environment,
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert done.returncode == 0, done.stderr
        assert not done.stderr
        lines = [line for line in done.stdout.splitlines() if line]
        assert lines[0] == "SET complete -o nosort -F _mavplan_completion mavplan"
        offered = [line for line in lines[1:] if not line.startswith("OPTION ")]
        return offered, {line.removeprefix("OPTION ") for line in lines[1:] if line.startswith("OPTION ")}

    complete.desk = desk
    return complete


def test_bash_completes_commands_options_and_choices(completed):
    assert completed("mavplan", "up")[0] == ["upload"]
    assert completed("mavplan", "plan", "--pl")[0] == ["--planner"]
    assert completed("mavplan", "plan", "--planner", "st")[0] == ["stoaik"]
    assert completed("mavplan", "plan", "x.toml", "--format", "k")[0] == ["kml", "kmz"]


def test_bash_completes_files_with_the_endings_a_command_takes_and_folders(completed):
    for name in ("a.toml", "b c.plan", "d.txt", "E.WAYPOINTS", ".hidden.plan"):
        (completed.desk / name).write_text("")
    (completed.desk / "folder").mkdir()
    (completed.desk / "folder/f,g.plan").write_text("")
    offered, options = completed("mavplan", "upload", "")
    assert set(offered) == {"b c.plan", "E.WAYPOINTS", "folder"}
    assert options == {"filenames"}
    assert completed("mavplan", "upload", "folder/")[0] == ["folder/f,g.plan"]
    assert completed("mavplan", "plan", "a")[0] == ["a.toml"]


def test_the_names_of_planners_are_those_there_are():
    from mavplan.planners import PLANNERS

    assert set(PLANNER_NAMES) == set(PLANNERS)


def test_completing_loads_nothing_heavy(tmp_path):
    code = (
        "import os, sys\n"
        "os.environ |= {'_MAVPLAN_COMPLETE': 'bash_complete', 'COMP_WORDS': 'mavplan\\nplan\\n--planner\\n', "
        "'COMP_CWORD': '3'}\n"
        "from mavplan.cli import run\n"
        "try:\n    run([])\nexcept SystemExit:\n    pass\n"
        "heavy = {'numpy', 'scipy', 'sklearn', 'cvxpy', 'pyproj', 'pydantic', 'rich'} & set(sys.modules)\n"
        "sys.exit(f'loaded: {heavy}' if heavy else 0)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert "plain,tloaik" in done.stdout


@pytest.mark.parametrize(
    ("shell", "sign"), [("zsh", "compadd -U -f"), ("fish", "complete --no-files --command mavplan")]
)
def test_the_other_shells_get_their_script(mavplan, shell, sign):
    ran = mavplan("completion", shell)
    assert ran.code == 0
    assert sign in ran.out
    assert "_MAVPLAN_COMPLETE" in ran.out
    assert re.search(r"%\(\w+\)s", ran.out) is None


def test_fish_is_told_that_a_folder_goes_on(tmp_path):
    (tmp_path / "folder").mkdir()
    asked = {"_MAVPLAN_COMPLETE": "fish_complete", "COMP_WORDS": "mavplan upload f", "COMP_CWORD": "f"}
    done = subprocess.run(
        [sys.executable, "-m", "mavplan"],
        cwd=tmp_path,
        env={**os.environ, **asked, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.stdout == "plain,folder/\n"
