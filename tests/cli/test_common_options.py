"""What all commands have in common: one object for scripts, how much is said, colours, help, what comes next."""

import json
import os
import re
import shutil
from pathlib import Path

import pytest

from mavplan.cli import COMMANDS, SECTIONS, console
from mavplan.cli.console import plain_table, print_table

ROOT = Path(__file__).resolve().parents[2]
ARGUMENTS = {
    "init": ["/proc/nowhere"],
    "plan": ["missing.toml"],
    "compare": ["missing.toml"],
    "study": ["-o", "out", "--seeds", "none"],
    "report": ["missing.plan"],
    "export": ["missing.plan", "-o", "x.kml"],
    "check": ["missing.plan"],
    "demo": ["missing.toml"],
    "upload": ["missing.plan", "--conn", "udpout:127.0.0.1:9"],
    "fly": ["missing.plan", "--conn", "udpout:127.0.0.1:9"],
    "info": ["--conn", "pigeon:1"],
    "verify": ["missing.plan", "--conn", "udpout:127.0.0.1:9"],
    "download": ["--conn", "pigeon:1", "-o", "x.plan"],
    "clear": ["--conn", "pigeon:1", "--yes"],
    "prove": ["missing.tlog", "--plan", "missing.plan"],
    "replan": ["missing.tlog", "--plan", "missing.plan", "-o", "rest"],
}


@pytest.fixture
def terminal(monkeypatch):
    """Standard output taken for a terminal of 80 columns."""
    monkeypatch.setattr(console, "is_terminal", lambda stream: True)
    monkeypatch.setattr(shutil, "get_terminal_size", lambda *_: os.terminal_size((80, 24)))


@pytest.fixture
def planned(mavplan, gallery):
    """A small mission with its plan beside it."""
    ran = mavplan("plan", gallery / "valley/scenario.toml", "-o", "valley.plan")
    assert ran.code == 0
    return "valley.plan"


@pytest.mark.parametrize("name", ARGUMENTS)
def test_a_command_that_fails_gives_scripts_one_object_that_says_why(mavplan, name):
    ran = mavplan(name, *ARGUMENTS[name], "--json")
    told = json.loads(ran.out)
    assert ran.code == told["exit_code"] == 2
    assert told["outcome"] == "bad_input"
    assert told["message"]
    assert told["message"].splitlines()[0] in ran.err


def test_wrong_usage_gives_scripts_an_object_too(mavplan):
    ran = mavplan("plan", "--json")
    assert json.loads(ran.out)["exit_code"] == 2
    assert "Missing argument" in ran.err


@pytest.fixture
def answered(mavplan):
    """Give to a command its object, which has the keys that are documented."""
    rows = re.findall(r"^\| (`.*`) \| (.*) \|$", (ROOT / "docs/cli.md").read_text("utf-8"), re.MULTILINE)
    documented = {
        name: re.findall(r"`(\w+)`", keys) for names, keys in rows for name in re.findall(r"`(\w+)`", names)
    }

    def answer(name, *args):
        ran = mavplan(name, *args, "--json")
        found = json.loads(ran.out)
        assert len(ran.out.splitlines()) == 1
        assert set(found) - {"warnings"} <= set(documented[name])
        assert "warnings" in found
        return found

    return answer


def test_init_export_report_and_check_answer_in_one_object(answered, planned):
    assert answered("init", "new")["written"] == ["new/scenario.toml", "new/users.csv"]
    assert answered("export", planned, "-o", "a.kml")["written"] == ["a.kml"]
    assert answered("report", planned, "--no-compare")["written"] == ["valley.html"]
    found = answered("check", planned)
    assert found["ok"] is True
    assert [vehicle["autopilot"] for vehicle in found["vehicles"]] == ["ardupilot"]
    assert found["vehicles"][0]["stored"] is True
    assert found["vehicles"][0]["flight"]["proof"]["all_met"] is True


def test_plan_config_and_completion_answer_in_one_object(answered, gallery):
    assert answered("plan", gallery / "valley/scenario.toml")["written"] == [
        "scenario.plan",
        "scenario.mavplan.json",
    ]
    assert answered("config")["file"] is None
    assert "complete" in answered("completion", "bash")["script"]


def test_every_command_is_documented_with_its_keys():
    text = (ROOT / "docs/cli.md").read_text("utf-8")
    table = text[text.index("## JSON") : text.index("## Settings")]
    assert all(re.search(rf"^\|[^|]*`{name}`[^|]*\|", table, re.MULTILINE) for name in COMMANDS)


def test_a_check_that_finds_something_answers_once_and_says_what(mavplan, planned):
    ran = mavplan("check", planned, "--fault", "hold-cut=4", "--json")
    found = json.loads(ran.out)
    assert ran.code == 6
    assert found["ok"] is False
    assert found["vehicles"][0]["flight"]["proof"]["all_met"] is False


def test_the_mock_vehicle_says_where_it_listens_as_an_object(capfd, monkeypatch):
    from sitl_mock import __main__ as mock

    def stop(_endpoint):
        raise KeyboardInterrupt

    monkeypatch.setattr(mock.Endpoint, "run", stop)
    assert mock.main(["--firmware", "px4", "--conn", "udpin:127.0.0.1:0", "--json"]) == 0
    told = json.loads(capfd.readouterr().out)
    assert (told["firmware"], told["system"]) == ("px4", 1)
    assert re.fullmatch(r"udpin:127\.0\.0\.1:[1-9]\d*", told["conn"][0])


def test_quiet_leaves_errors_only(mavplan, gallery):
    ran = mavplan("plan", gallery / "coast/scenario.toml", "--quiet")
    assert (ran.code, ran.out, ran.err) == (0, "", "")
    assert "error" in mavplan("-q", "plan", "missing.toml").err


def test_verbose_tells_steps_with_their_time_and_leaves_the_result_alone(mavplan, gallery):
    scenario = gallery / "valley/scenario.toml"
    plain, verbose = mavplan("plan", scenario), mavplan("--verbose", "plan", scenario)
    assert verbose.out == plain.out
    steps = re.findall(r"^ +(\d+\.\d\d) s  (.+)$", verbose.err, re.MULTILINE)
    assert [words for _, words in steps] == [f"reading {scenario}", "planning", "writing", "done"]
    times = [float(at) for at, _ in steps]
    assert times == sorted(times)


def test_the_last_of_quiet_and_verbose_is_obeyed(mavplan, gallery):
    scenario = gallery / "valley/scenario.toml"
    assert mavplan("-v", "plan", scenario, "-q").err == ""
    assert "planning" in mavplan("plan", scenario, "-q", "-v").err


@pytest.mark.parametrize(("variables", "coloured"), [({}, False), ({"FORCE_COLOR": "1"}, True)])
def test_colours_are_off_in_a_pipe_unless_they_are_forced(mavplan, monkeypatch, variables, coloured):
    for name in ("NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert ("\x1b[" in mavplan("plan", "missing.toml").err) is coloured


def test_no_color_means_no_colour_on_a_terminal(mavplan, terminal, planned, monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")
    ran = mavplan("plan", "missing.toml")
    assert "\x1b[3" not in ran.err
    assert "error: missing.toml" in ran.err


def test_a_table_fits_eighty_columns_and_no_figure_is_cut(terminal, capfd):
    table = plain_table("title")
    for heading in ("latitude", "longitude", "a long heading"):
        table.add_column(heading, no_wrap=True, justify="right")
    table.add_column("words")
    table.add_row("56.123456", "-3.1234567", "1,234,567.8 m", "many words " * 12)
    print_table(table)
    out = capfd.readouterr().out
    assert "…" not in out
    assert all(len(line) <= 80 for line in out.splitlines())
    assert "1,234,567.8 m" in out


def test_a_table_that_cannot_fit_stays_whole(terminal, capfd):
    table = plain_table()
    for number in range(12):
        table.add_column(f"heading {number}", no_wrap=True)
    table.add_row(*(f"{number:010d}" for number in range(12)))
    print_table(table)
    out = capfd.readouterr().out
    assert all(f"{number:010d}" in out for number in range(12))


def test_what_comes_next_is_told_on_a_terminal_only(mavplan, gallery, monkeypatch):
    scenario = gallery / "valley/scenario.toml"
    assert "next:" not in mavplan("plan", scenario).out
    monkeypatch.setattr(console, "is_terminal", lambda stream: True)
    assert "next: mavplan check 'my valley.plan'" in mavplan("plan", scenario, "-o", "my valley.plan").out
    assert "next: mavplan report f-1.plan" in mavplan("plan", scenario, "--vehicles", "2", "-o", "f.plan").out
    assert "next:" not in mavplan("plan", scenario, "--quiet").out
    assert "next:" not in mavplan("plan", scenario, "--json").out


@pytest.mark.parametrize(
    ("typed", "meant"), [("hlep", "help"), ("uplaod", "upload"), ("export-kml", "export"), ("plna", "plan")]
)
def test_of_a_misspelt_command_the_nearest_is_named(mavplan, typed, meant):
    ran = mavplan(typed)
    assert ran.code == 2
    assert f"did you mean '{meant}'?" in ran.err


def test_without_arguments_help_is_shown_and_nothing_is_done(mavplan):
    ran = mavplan()
    assert ran.code == 2
    assert "Examples:" in ran.err + ran.out


def test_help_lists_every_command_under_what_people_do_and_help_of_a_command_is_its_own(mavplan):
    shown = mavplan("help").out
    at = [shown.index(f"\n{title}:\n") for title in SECTIONS]
    assert at == sorted(at)
    assert all(f"\n  {name} " in shown for name in COMMANDS)
    assert mavplan("help", "plan").out == mavplan("plan", "--help").out


@pytest.mark.parametrize("name", [name for name in COMMANDS if name != "sim"])
def test_the_help_of_every_command_has_an_example(mavplan, name):
    assert f"\n  mavplan {name}" in mavplan(name, "--help").out
