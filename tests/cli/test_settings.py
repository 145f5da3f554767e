"""Settings from the environment and from a file, and which of them is obeyed."""

import json
from pathlib import Path

import pytest

from mavplan.cli import COMMANDS, LazyGroup, cli
from mavplan.cli.common import IN_PERSON, options_of, variables_of


@pytest.fixture(autouse=True)
def nobodys_settings(monkeypatch, tmp_path):
    """No settings of whoever runs the tests."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "xdg"))


@pytest.fixture
def where(mavplan, monkeypatch):
    """Tell which --conn an upload is given: bad ones are named in the error."""
    monkeypatch.delenv("MAVPLAN_CONN", raising=False)

    def ask(*args):
        ran = mavplan("info", *args)
        assert ran.code == 2
        return next(name for name in ("said:1", "own:1", "every:1", "file:1", "Missing") if name in ran.err)

    return ask


def test_the_command_line_beats_the_environment_and_that_the_file(where, monkeypatch):
    assert where() == "Missing"
    Path("mavplan.toml").write_text('[mavplan]\nconn = "every:1"\n')
    assert where() == "every:1"
    Path("mavplan.toml").write_text('[mavplan]\nconn = "every:1"\n[info]\nconn = "file:1"\n')
    assert where() == "file:1"
    monkeypatch.setenv("MAVPLAN_CONN", "every:1")
    assert where() == "every:1"
    monkeypatch.setenv("MAVPLAN_INFO_CONN", "own:1")
    assert where() == "own:1"
    assert where("--conn", "said:1") == "said:1"


def test_the_file_is_the_working_folders_else_the_users_else_the_one_that_is_named(where, tmp_path):
    mine = tmp_path / "xdg/mavplan/config.toml"
    mine.parent.mkdir(parents=True)
    mine.write_text('[info]\nconn = "own:1"\n')
    assert where() == "own:1"
    Path("mavplan.toml").write_text('[info]\nconn = "file:1"\n')
    assert where() == "file:1"


def test_a_named_file_is_read_instead(mavplan):
    Path("mavplan.toml").write_text("[info]\ntimeout = 3\n")
    Path("field.toml").write_text('[info]\nconn = "udpout:127.0.0.1:9"\n')
    shown = json.loads(mavplan("--config", "field.toml", "config", "--json").out)
    assert shown["file"] == "field.toml"
    assert [one["option"] for one in shown["settings"]] == ["conn"]
    assert mavplan("--config", "missing.toml", "config").code == 2


def test_a_list_and_a_flag_come_from_a_file_and_paths_stand_beside_it(mavplan, tmp_path, gallery):
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    (folder / "s.toml").write_text('[plan]\noutput = ["a.plan", "b.kml"]\nquiet = true\n')
    ran = mavplan("--config", "elsewhere/s.toml", "plan", gallery / "valley/scenario.toml")
    assert (ran.code, ran.out) == (0, "")
    assert {path.name for path in folder.iterdir()} == {"s.toml", "a.plan", "a.mavplan.json", "b.kml"}


def test_verbose_on_the_command_line_beats_quiet_in_a_file(mavplan, gallery):
    Path("mavplan.toml").write_text("[mavplan]\nquiet = true\n")
    scenario = gallery / "valley/scenario.toml"
    assert mavplan("plan", scenario).out == ""
    assert "planning" in mavplan("-v", "plan", scenario).err


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("[uplod]\n", "mavplan.toml, [uplod]: is no command; nearest is upload"),
        ('[info]\ncon = "udp:"\n', "mavplan.toml, [info] con: is no setting; nearest is conn"),
        ("[mavplan]\ntimeout = 3\n", "mavplan.toml, [mavplan] timeout: is no setting"),
        ('[info]\ntimeout = "long"\n', "mavplan.toml, [info] timeout: 'long' is not"),
        ("[info]\ntimeout = -1\n", "mavplan.toml, [info] timeout: -1.0 is not in the range"),
        ("[info]\njson = 1\n", "mavplan.toml, [info] json: found 1; allowed are true and false"),
        (
            "[info]\nsystem = [1, 2]\n",
            "mavplan.toml, [info] system: found [1, 2]; allowed is a text or a number",
        ),
        ("[info\n", "mavplan.toml: is not TOML that can be read"),
        ("info = 3\n", "mavplan.toml, info: is a value; allowed is a table [info]"),
        ("#" * 1_100_000, "mavplan.toml: is not TOML that can be read: is longer than"),
    ],
)
def test_what_is_wrong_in_a_file_is_one_sentence_before_anything_is_done(mavplan, content, said):
    Path("mavplan.toml").write_text(content)
    ran = mavplan("info", "--conn", "udpout:127.0.0.1:9")
    assert ran.code == 2
    assert ran.err.startswith(f"error: {said}")
    assert len(ran.err.splitlines()) == 1


def test_all_that_is_wrong_in_a_file_is_shown_at_once(mavplan):
    Path("mavplan.toml").write_text('[info]\ncon = "x"\n[plan]\noutptu = "y"\n[study]\njobs = 0\n')
    ran = mavplan("config")
    assert ran.code == 2
    assert len(ran.err.splitlines()) == 3


@pytest.mark.parametrize("name", ["fly", "clear", "upload"])
def test_a_persons_yes_is_no_setting(mavplan, monkeypatch, name):
    command = LazyGroup.get_command(cli, None, name)
    options = [one for one in options_of(command) if one.opts[0].removeprefix("--") in IN_PERSON]
    assert options
    for option in options:
        assert not list(variables_of(command, option))
        key = option.opts[0].removeprefix("--")
        Path("mavplan.toml").write_text(f"[{name}]\n{key} = true\n")
        ran = mavplan(name, "x.plan", "--conn", "udpout:127.0.0.1:9")
        assert ran.code == 2
        assert f"[{name}] {key}: is said on the command line only" in ran.err
        monkeypatch.setenv(f"MAVPLAN_{name}_{key}".upper().replace("-", "_"), "1")
        with command.make_context(
            name, ["x.plan", "--conn", "udp:"] if name != "clear" else ["--conn", "udp:"]
        ) as ctx:
            assert not ctx.params[option.name]


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_has_a_variable_of_its_own(name):
    command = LazyGroup.get_command(cli, None, name)
    for option in options_of(command):
        names = list(variables_of(command, option))
        in_person = any(one.removeprefix("--") in IN_PERSON for one in option.opts)
        assert in_person or names[0].startswith(f"MAVPLAN_{name.upper()}_")


def test_what_is_in_force_is_shown_with_its_place_and_what_means_nothing_is_said(mavplan, monkeypatch):
    Path("mavplan.toml").write_text(
        '[mavplan]\nconn = "udp:1"\n[upload]\ntimeout = 30\nmax-home-height = 5\n'
    )
    monkeypatch.setenv("MAVPLAN_UPLOAD_TIMEOUT", "4")
    monkeypatch.setenv("MAVPLAN_UPLOD_CONN", "x")
    ran = mavplan("config", "--json")
    told = json.loads(ran.out)
    assert {(one["command"], one["option"], one["value"], one["made_in"]) for one in told["settings"]} == {
        ("upload", "timeout", "4", "environment, MAVPLAN_UPLOAD_TIMEOUT"),
        ("mavplan", "conn", "udp:1", "mavplan.toml, [mavplan]"),
        ("upload", "max-home-height", "5", "mavplan.toml, [upload]"),
    }
    assert "MAVPLAN_UPLOD_CONN: is no setting; nearest is MAVPLAN_UPLOAD_CONN" in told["warnings"][0]


def test_a_key_that_was_set_itself_is_not_shown(mavplan, monkeypatch):
    key = "0123456789abcdef" * 4
    monkeypatch.setenv("MAVPLAN_SIGNING_KEY", key)
    Path("mavplan.toml").write_text(f'[upload]\nsigning-key = "{key}"\n')
    for args in (["config"], ["config", "--json"]):
        ran = mavplan(*args)
        assert ran.code == 0
        assert key not in ran.out + ran.err
        assert "not shown" in ran.out
