"""The folder of a study: cut at any byte it goes on to the same table, and another study is kept out of it."""

import dataclasses
import json
import shutil
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import mavplan
from mavplan.errors import InputError
from mavplan.study.engine import run_study
from mavplan.study.outputs import write_outputs
from mavplan.study.settings import Settings
from mavplan.study.store import open_store, read_settings
from mavplan.study.summary import summarise
from mavplan.workers.versions import COUNTING_CODE, versions

SMALL = Settings(mean_users=(6.0,), clusters=(2, 3), seeds=(0, 1, 2), planners=("tloaik", "sbw"))


def finish(folder, wanted=SMALL):
    """Run what is missing here and now; return the rows and the bytes of all files that come of them."""
    rows, _ = run_study(folder, wanted, jobs=1)
    paths = write_outputs(folder, wanted, rows, summarise(rows))
    return rows, [path.read_bytes() for path in paths]


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A whole study: its folder, rows and files."""
    folder = tmp_path_factory.mktemp("finished") / "study"
    return folder, *finish(folder)


@pytest.fixture
def folder(finished, tmp_path):
    """A copy of the whole study to spoil."""
    return shutil.copytree(finished[0], tmp_path / "study")


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(share=st.floats(0.0, 1.0), zeros=st.integers(0, 40))
def test_cut_at_any_byte_and_restarted_a_study_gives_the_same_table(finished, tmp_path, share, zeros):
    """Zeros behind the cut are what some file systems leave after the power failed."""
    original, rows, files = finished
    whole = (original / "cases.jsonl").read_bytes()
    folder = tmp_path / "study"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(original, folder, ignore=shutil.ignore_patterns("*.csv"))
    kept = whole[: round(share * len(whole))]
    (folder / "cases.jsonl").write_bytes(kept + b"\0" * zeros)
    assert finish(folder) == (rows, files)
    after = (folder / "cases.jsonl").read_bytes()
    assert sorted(after.splitlines()) == sorted(whole.splitlines()), "a row was lost or is there twice"
    assert after.startswith(kept[: kept.rfind(b"\n") + 1]), "what was whole was touched"


def test_a_finished_study_is_not_run_again(folder, finished, monkeypatch):
    monkeypatch.setattr("mavplan.study.engine.run_case", None)
    assert finish(folder) == finished[1:]


def test_a_kill_before_the_first_row_leaves_a_folder_that_can_be_used(tmp_path, finished):
    (tmp_path / "cases.jsonl").touch()
    assert finish(tmp_path)[0] == finished[1]


@pytest.mark.parametrize(
    "more",
    [
        {"seeds": (0, 1, 2, 3)},
        {"clusters": (2, 3, 4)},
        {"mean_users": (6.0, 7.0)},
        {"planners": ("tloaik", "boaik", "sbw")},
    ],
)
def test_an_extension_runs_only_what_is_missing_and_ends_as_if_begun_so(
    folder, tmp_path, finished, more, monkeypatch
):
    from mavplan.study import engine

    wanted, ran = dataclasses.replace(SMALL, **more), []
    genuine = engine.run_case
    monkeypatch.setattr(
        engine, "run_case", lambda case, names: ran.append((case, names)) or genuine(case, names)
    )
    extended = finish(folder, wanted)
    there = {(row.case, row.planner) for row in finished[1]}
    assert not there & {(case, name) for case, names in ran for name in names}
    assert sum(len(names) for _, names in ran) == len(extended[0]) - len(there)
    assert finish(tmp_path / "anew", wanted) == extended
    assert read_settings(folder) == wanted


@pytest.mark.parametrize(
    "other",
    [
        {"seeds": (0, 1)},
        {"clusters": (2,)},
        {"mean_users": (16.0,)},
        {"generator": "users"},
        {"held": "power"},
        {"planners": ("tloaik",)},
    ],
)
def test_settings_that_do_not_extend_are_refused_and_nothing_changes(folder, other):
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(InputError, match=rf"study\.json, {next(iter(other))}: .*the study there") as raised:
        finish(folder, dataclasses.replace(SMALL, **other))
    assert raised.value.problems[0].code == "other-study"
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_a_regime_with_other_numbers_is_refused(folder):
    content = json.loads((folder / "study.json").read_text())
    content["stand_ins"]["radio"]["noise_dbm"] = -100.0
    (folder / "study.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match="its regime has other numbers"):
        finish(folder)


def test_rows_of_other_versions_are_told_of(folder):
    content = json.loads((folder / "study.json").read_text())
    content["versions"]["numpy"] = "1.0"
    (folder / "study.json").write_text(json.dumps(content))
    _, warnings = run_study(folder, SMALL, jobs=1)
    assert [(problem.severity, problem.code) for problem in warnings] == [("warning", "other-versions")]
    assert "numpy 1.0 →" in warnings[0].message


def test_rows_of_other_code_are_refused_even_where_the_version_is_the_same(folder):
    content = json.loads((folder / "study.json").read_text())
    content["versions"]["code"] = "0123456789abcdef"
    (folder / "study.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match="its rows are of another state of mavplan"):
        finish(folder)


def test_the_code_that_counts_is_there():
    package = Path(mavplan.__file__).parent
    for pattern in COUNTING_CODE:
        assert list(package.glob(pattern)), pattern
    assert len(versions()["code"]) == 16


def test_only_one_process_works_in_a_study(folder):
    with (
        open_store(folder, SMALL),
        pytest.raises(InputError, match="another process is at work"),
        open_store(folder, SMALL),
    ):
        pass
    with open_store(folder, SMALL) as store:
        assert len(store.rows) == 12


def test_rows_without_settings_are_refused(folder):
    (folder / "study.json").unlink()
    with pytest.raises(InputError, match=r"holds rows, but no study\.json"):
        finish(folder)


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b"[]", b'"x"', b"{}", b"\xff", b'{"format": 2}', b'{"format": 1, "settings": {"seeds": 3}}',
     b'{"format": 1, "stand_ins": 1, "versions": {}, "settings": {"seeds": "3", "colour": "red"}}'],
)  # fmt: skip
def test_a_settings_file_that_is_something_else_is_refused_in_one_sentence(folder, content):
    (folder / "study.json").write_bytes(content)
    with pytest.raises(InputError, match=r"study\.json: is (not the settings of a study|of format 2)"):
        finish(folder)


@pytest.mark.parametrize(
    "line", [b"\n", b"{}\n", b'{"seed":1}\n', b"[1]\n", b"\0\0\n", b'{"mean_users":16.\n']
)
def test_damage_in_the_midst_is_told_with_its_line_and_not_passed_over(folder, line):
    path = folder / "cases.jsonl"
    rows = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join([*rows[:3], line, *rows[3:]]))
    with pytest.raises(InputError, match=r"cases\.jsonl, line 4: is no row of a study"):
        finish(folder)


def test_a_row_that_is_there_twice_counts_once_and_one_that_disagrees_is_refused(folder, finished):
    path = folder / "cases.jsonl"
    rows = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join([*rows, rows[0]]))
    assert finish(folder) == finished[1:]
    changed = json.loads(rows[0])
    changed["length_m"] += 1.0
    path.write_bytes(b"".join([*rows, json.dumps(changed).encode() + b"\n"]))
    with pytest.raises(InputError, match="line 13: says otherwise than an earlier line"):
        finish(folder)


def test_a_row_of_another_study_is_refused(folder):
    path = folder / "cases.jsonl"
    stranger = json.loads(path.read_bytes().splitlines()[0])
    stranger["seed"] = 99
    path.write_bytes(path.read_bytes() + json.dumps(stranger).encode() + b"\n")
    with pytest.raises(InputError, match=r"line 13: is of a case or planner that is not in study\.json"):
        finish(folder)


def test_a_folder_that_cannot_be_made_is_told_in_one_sentence(tmp_path):
    with pytest.raises(InputError, match="cannot be used as the folder of a study: No such file"):
        finish(tmp_path / "no" / "such")
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="cannot be used as the folder of a study"):
        finish(tmp_path / "file")


def test_a_full_disk_is_told_and_what_was_written_is_kept(tmp_path, finished, monkeypatch):
    import os

    genuine = os.write

    def full(descriptor, data):
        if b"tloaik" not in data:
            return genuine(descriptor, data)
        if len(data) < 1200:
            raise OSError(28, "No space left on device")
        return genuine(descriptor, data[:1000])

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", full)
        with pytest.raises(InputError, match="No space left on device; what was finished before is kept"):
            finish(tmp_path)
    assert (tmp_path / "cases.jsonl").stat().st_size > 0
    assert finish(tmp_path)[0] == finished[1]
