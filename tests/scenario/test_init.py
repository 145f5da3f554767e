"""`mavplan init`: what it writes is a scenario, and it overwrites nothing."""

import pytest

from mavplan.cli import run
from mavplan.scenario import load_scenario


def test_what_is_written_can_be_planned_as_it_is(tmp_path, capsys):
    """A dozen users, two pairs, no warning; and the next step is named."""
    folder = tmp_path / "new" / "here"
    assert run(["init", str(folder)]) == 0
    scenario = load_scenario(folder / "scenario.toml")
    assert len(scenario.users) == 12
    assert (scenario.users.mate >= 0).sum() == 4
    assert scenario.warnings == ()
    assert f"mavplan plan {folder / 'scenario.toml'}" in capsys.readouterr().out
    assert sorted(path.name for path in folder.iterdir()) == ["scenario.toml", "users.csv"]


def test_the_present_folder_is_the_default(tmp_path, monkeypatch):
    """Without an argument the files appear here."""
    monkeypatch.chdir(tmp_path)
    assert run(["init"]) == 0
    assert (tmp_path / "users.csv").exists()


@pytest.mark.parametrize("there", [["scenario.toml"], ["users.csv"], ["scenario.toml", "users.csv"]])
def test_nothing_is_overwritten_and_what_is_in_the_way_is_listed(tmp_path, capsys, there):
    """Exit code 2, every file in the way named, none written and none changed."""
    for name in there:
        (tmp_path / name).write_text("mine", encoding="utf-8")
    assert run(["init", str(tmp_path)]) == 2
    told = capsys.readouterr().err
    assert all(str(tmp_path / name) in told for name in there)
    assert {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()} == dict.fromkeys(
        there, "mine"
    )


def test_a_file_where_the_folder_should_be_is_said(tmp_path, capsys):
    """No traceback."""
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert run(["init", str(tmp_path / "file")]) == 2
    assert run(["init", str(tmp_path / "file" / "below")]) == 2
    assert capsys.readouterr().err.count("the folder cannot be made") == 2
