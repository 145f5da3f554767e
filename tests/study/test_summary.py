"""The table: ratios and paired differences by hand, and the published orderings in a reduced form."""

import csv
import io

import numpy as np
import pytest

from mavplan.study.cases import Case, Row
from mavplan.study.engine import run_study
from mavplan.study.outputs import csv_text, parquet_bytes
from mavplan.study.settings import Settings
from mavplan.study.store import COLUMNS, row_values
from mavplan.study.summary import flat, next_in_order, summarise


def row(seed, planner, length_m, rate, rho_e):
    """A row against a benchmark of 1000 m and 10 bit/s/Hz."""
    return Row(Case(16.0, 100.0, 3.0, 4, seed), planner, 8, 4, 3, length_m, rate, rho_e, 1000.0, 10.0)


BY_HAND = [
    row(0, "boaik", 500.0, 11.0, 2.2), row(0, "stoaik", 600.0, 12.0, 2.0), row(0, "sbw", 1000.0, 10.0, 1.0),
    row(1, "boaik", 300.0, 9.0, 3.0), row(1, "stoaik", 400.0, 12.0, 2.4), row(1, "sbw", 1000.0, 10.0, 1.0),
    row(2, "boaik", 400.0, 10.0, 2.6), row(2, "stoaik", 500.0, 9.0, None), row(2, "sbw", 1000.0, 10.0, 1.0),
]  # fmt: skip


def test_the_table_by_hand():
    boaik, stoaik, sbw = summarise(BY_HAND)
    assert boaik.length.value == pytest.approx(0.4)
    assert stoaik.sum_rate.value == pytest.approx(1.1)
    assert boaik.rho_e.value == pytest.approx(2.6)
    # Without a value of ρ_e a case counts neither in the mean nor in the difference.
    assert stoaik.rho_e.value == pytest.approx(2.2)
    assert (boaik.less, boaik.rho_e_difference.value) == ("stoaik", pytest.approx(0.4))
    assert (stoaik.less, stoaik.rho_e_difference.value) == ("sbw", pytest.approx(1.2))
    assert (sbw.less, sbw.rho_e_difference, sbw.cases) == (None, None, 3)


def test_each_planner_is_compared_with_the_next_that_was_run():
    assert next_in_order("boaik", ["tloaik", "boaik"]) == "tloaik"
    assert next_in_order("tloaik", ["tloaik", "boaik"]) is None
    assert next_in_order("sbw", ["tloaik", "sbw"]) is None
    assert next_in_order("another", ["another", "sbw"]) == "sbw"


def test_csv_gives_back_every_bit_and_an_empty_cell_where_there_is_no_value():
    text = csv_text([row_values(one) for one in BY_HAND], COLUMNS)
    read = list(csv.DictReader(io.StringIO(text)))
    assert [float(line["length_m"]) for line in read] == [one.length_m for one in BY_HAND]
    assert [line["rho_e"] for line in read][7] == ""
    third = row(0, "boaik", 1 / 3, 0.1 + 0.2, 1e-300)
    (back,) = csv.DictReader(io.StringIO(csv_text([row_values(third)], COLUMNS)))
    assert (float(back["length_m"]), float(back["sum_rate_bit_s_hz"]), float(back["rho_e"])) == (
        1 / 3, 0.1 + 0.2, 1e-300,
    )  # fmt: skip


def test_parquet_holds_the_same_rows():
    parquet = pytest.importorskip("pyarrow.parquet", reason="Parquet needs pyarrow (extra 'study')")
    content = parquet_bytes([row_values(one) for one in BY_HAND])
    read = parquet.read_table(io.BytesIO(content)).to_pylist()
    assert read == [row_values(one) for one in BY_HAND]


@pytest.fixture(scope="module")
def reduced(tmp_path_factory):
    """λ = 16, 150 seeds, by planner."""
    wanted = Settings(mean_users=(16.0,), seeds=tuple(range(150)))
    rows, _ = run_study(tmp_path_factory.mktemp("reduced") / "study", wanted, jobs=1)
    return {line.planner: line for line in summarise(rows)}


def test_the_benchmark_against_itself_is_one_without_width(reduced):
    for found in (reduced["sbw"].length, reduced["sbw"].sum_rate, reduced["sbw"].rho_e):
        assert (found.value, found.half_width) == (1.0, 0.0)


def test_no_published_ordering_is_significantly_reversed(reduced):
    """Length TLOAIK < BOAIK < STOAIK < SBW, throughput STOAIK highest, ρ_e BOAIK > STOAIK > TLOAIK > SBW."""
    lengths = [reduced[name].length.value for name in ("tloaik", "boaik", "stoaik", "sbw")]
    assert lengths == sorted(lengths)
    assert reduced["tloaik"].length.high < 0.5
    rates = [reduced[name].sum_rate.value for name in ("stoaik", "boaik", "tloaik")]
    assert rates == sorted(rates, reverse=True)
    assert reduced["stoaik"].sum_rate.low > 1.0
    for name, behind in (("boaik", "stoaik"), ("stoaik", "tloaik"), ("tloaik", "sbw")):
        assert reduced[name].less == behind
        assert reduced[name].rho_e_difference.high > 0.0
    assert all(reduced[name].rho_e.low > 2.0 for name in ("boaik", "stoaik", "tloaik"))


def test_a_flat_line_has_a_column_for_each_end_of_each_interval(reduced):
    table = flat(reduced["boaik"])
    assert table["rho_e_low"] < table["rho_e"] < table["rho_e_high"]
    assert table["length"] == pytest.approx(np.mean([table["length_low"], table["length_high"]]))
    assert flat(reduced["sbw"])["rho_e_difference"] is None
