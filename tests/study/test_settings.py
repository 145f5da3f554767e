"""The settings of a study: what is refused, all at once, and what extends what."""

import dataclasses

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.study.settings import Settings, ranges_text, seeds_of


@given(st.sets(st.integers(0, 10_000), min_size=1, max_size=60))
def test_seeds_written_as_ranges_read_back_the_same(seeds):
    ordered = sorted(seeds)
    assert seeds_of(ranges_text(ordered)) == tuple(ordered)


def test_a_number_is_how_many_seeds_and_a_range_is_which():
    assert seeds_of("3") == (0, 1, 2)
    assert seeds_of("3-3") == (3,)
    assert seeds_of(" 5-6, 0-1 ,6-7") == (0, 1, 5, 6, 7)


@pytest.mark.parametrize("text", ["", "0", "a", "3-1", "1-2-3", "-1", "1,2", "1.5", "0-99999999", "9" * 5000])
def test_what_names_no_seeds_is_refused_with_what_is_allowed(text):
    with pytest.raises(ValueError, match="allowed is a number of seeds"):
        seeds_of(text)


def test_settings_round_trip_through_json():
    made = Settings(mean_users=(8.5, 20), seeds=(5, 6, 9), generator="users", held="power", planners=("sbw",))
    assert Settings.from_json(made.to_json()) == made


def test_values_are_put_in_order_once_each_whatever_type_they_come_in():
    made = Settings(mean_users=(20, 15.0, 15), seeds=(3, 1, 3), snr_threshold_db=(-0.0, 0))
    assert (made.mean_users, made.seeds) == ((15.0, 20.0), (1, 3))
    assert str(made.snr_threshold_db) == "(0.0,)"


def test_every_value_that_cannot_be_taken_is_told_at_once():
    with pytest.raises(InputError) as raised:
        Settings(
            mean_users=(0.0, float("nan")),
            clusters=(0,),
            altitude_m=(-1.0,),
            snr_threshold_db=(float("inf"),),
            planners=("tloaik", "shortest"),
            seeds=(),
        )
    places = [problem.where for problem in raised.value.problems]
    assert sorted(places) == [
        "altitude_m", "clusters", "mean_users", "mean_users", "planners", "seeds", "snr_threshold_db",
    ]  # fmt: skip


def test_an_altitude_that_reaches_nobody_with_the_power_held_is_refused():
    with pytest.raises(InputError, match=r"snr_threshold_db 20: nobody .* below 58\.2 m"):
        Settings(snr_threshold_db=(3.0, 20.0), held="power")
    Settings(snr_threshold_db=(3.0, 20.0), held="radius")


def test_a_threshold_that_takes_more_power_than_any_radio_has_is_refused():
    with pytest.raises(InputError, match="transmit power of 117"):
        Settings(snr_threshold_db=(100.0,))


@pytest.mark.parametrize(
    "change",
    [
        {"seeds": (0, 1, 2)},
        {"mean_users": (15.0, 16.0, 20.0, 40.0)},
        {"clusters": (2, 4)},
        {"snr_threshold_db": (0.0, 3.0)},
        {"altitude_m": (80.0, 100.0)},
        {"planners": ("sbw", "stoaik", "tloaik")},
    ],
)
def test_more_values_extend_a_study_and_fewer_do_not(change):
    small = Settings(seeds=(0, 1), planners=("tloaik", "sbw"))
    large = dataclasses.replace(small, **change)
    assert large.not_extending(small) == []
    assert [problem.where for problem in small.not_extending(large)] == list(change)


@pytest.mark.parametrize("change", [{"generator": "users"}, {"held": "power"}])
def test_another_draw_is_another_study(change):
    made = Settings(seeds=(0,))
    assert len(dataclasses.replace(made, **change).not_extending(made)) == 1
