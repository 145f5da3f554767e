"""``mavplan study`` as people type it."""

import csv
import json
import re

import pytest

from mavplan import cli

SMALL = ("--mean-users", "6,7", "--clusters", "2", "--seeds", "3", "--jobs", "1")


@pytest.fixture
def study(monkeypatch, tmp_path, capfd):
    """Run the command in a folder of its own; return exit code, output and errors."""
    monkeypatch.chdir(tmp_path)

    def run(*args):
        code = cli.run(["study", *args])
        return code, *capfd.readouterr()

    return run


def test_a_study_prints_its_table_and_writes_its_files(study, tmp_path):
    code, output, errors = study("-o", "out", *SMALL)
    assert (code, errors) == (0, "")
    assert re.search(r"BOAIK .*±.*to STOAIK", output)
    assert re.search(r"SBW .* 1\.000 ±0\.000", output)
    assert "written: out/study.csv, out/summary.csv" in output
    with (tmp_path / "out/study.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [(row["mean_users"], row["seed"], row["planner"]) for row in rows] == [
        (mean, seed, planner)
        for mean in ("6.0", "7.0")
        for seed in "012"
        for planner in ("tloaik", "stoaik", "boaik", "sbw")
    ]
    with (tmp_path / "out/summary.csv").open(newline="") as stream:
        assert [line["cases"] for line in csv.DictReader(stream)] == ["3"] * 8


def test_json_is_one_object_with_the_table(study):
    code, output, _ = study("-o", "out", *SMALL, "--json", "--planners", "tloaik,sbw")
    report = json.loads(output)
    assert (code, report["rows"], report["settings"]["planners"]) == (0, 12, ["tloaik", "sbw"])
    assert [line["planner"] for line in report["summary"]] == ["tloaik", "sbw"] * 2
    assert {"length", "length_low", "length_high", "rho_e_difference"} <= set(report["summary"][0])


def test_in_a_folder_with_a_study_what_is_not_said_stays_as_it_is_there(study):
    study("-o", "out", *SMALL)
    code, output, _ = study("-o", "out", "--seeds", "4", "--jobs", "1", "--json")
    report = json.loads(output)
    assert (code, report["rows"]) == (0, 2 * 4 * 4)
    assert report["settings"]["mean_users"] == [6.0, 7.0]


def test_without_options_it_is_the_papers_regime(study, monkeypatch):
    seen = []
    monkeypatch.setattr(
        "mavplan.study.engine.run_study", lambda folder, settings, **_: seen.append(settings) or ([], ())
    )
    monkeypatch.setattr("mavplan.study.outputs.write_outputs", lambda *_, **__: [])
    study("--json")
    (found,) = seen
    assert (found.mean_users, found.clusters, found.altitude_m, found.snr_threshold_db) == (
        (15.0, 16.0, 20.0), (4,), (100.0,), (3.0,),
    )  # fmt: skip
    assert (len(found.seeds), found.generator, found.held) == (300, "pairs", "radius")
    assert found.planners == ("tloaik", "stoaik", "boaik", "sbw")


def test_another_study_in_the_folder_is_refused(study):
    study("-o", "out", *SMALL)
    code, output, errors = study("-o", "out", "--seeds", "2")
    assert (code, output) == (2, "")
    assert "seeds: the study there also has 2-2; more values can be added to a study, none left out" in errors


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--mean-users", "x"), "'x' is not a list of numbers"),
        (("--clusters", "2.5"), "'2.5' is not a list of whole numbers"),
        (("--seeds", "many"), "allowed is a number of seeds (300) or ranges of them"),
        (("--planners", "shortest"), "unknown planner 'shortest'; known: tloaik"),
        (("--threshold-db", "20", "--hold", "power"), "nobody on the ground can be reached"),
        (("--jobs", "0"), "0 is not in the range"),
        (("--cluster", "there"), "allowed is 'local' or the address"),
    ],
)
def test_what_cannot_be_taken_is_told_in_a_sentence(study, options, said):
    code, _, errors = study("-o", "out", *options)
    assert code == 2
    assert said in errors
    assert "Traceback" not in errors


def test_the_help_shows_its_examples_a_line_each(study):
    code, output, _ = study("--help")
    assert code == 0
    assert "\n  mavplan study -o out/regime --seeds 2000 --pictures png\n" in output


def test_pictures_and_parquet_are_written_where_asked_for(study, tmp_path):
    pytest.importorskip("matplotlib", reason="pictures need matplotlib (extra 'figures')")
    pytest.importorskip("pyarrow", reason="Parquet needs pyarrow (extra 'study')")
    code, _, _ = study("-o", "out", *SMALL, "--threshold-db", "0,3", "--pictures", "svg", "--parquet")
    assert code == 0
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"figure-8.svg", "figure-9.svg", "sweep-threshold.svg", "study.parquet"} <= written
    assert "sweep-clusters.svg" not in written
