"""How failure modes are written."""

import pytest

from sitl_mock.faults import FAULTS, Faults, Moment, fault_help, parse_faults
from sitl_mock.flight.faults import AtItem
from sitl_mock.items import Result


def test_the_example_of_the_help_is_read() -> None:
    """Every kind of value."""
    faults = parse_faults(
        "drop=0.3,dup=0.1,reorder,delay=200ms,corrupt=0.01,silent-after=7,ack-lost,nack=NO_SPACE,reboot-at=12,second-gcs"
    )
    assert (faults.drop_up, faults.drop_down, faults.dup, faults.corrupt) == (0.3, 0.3, 0.1, 0.01)
    assert faults.reorder > 0
    assert faults.delay_s == 0.2
    assert (faults.silent_after, faults.reboot_at) == (Moment(item=7), Moment(item=12))
    assert faults.nack is Result.NO_SPACE
    assert faults.second_gcs == "read"
    assert faults.ack_lost > 1000


def test_times_and_items_are_told_apart() -> None:
    """``7`` is an item, ``7s`` and ``700ms`` are times."""
    assert parse_faults("silent-after=7s").silent_after == Moment(time_s=7.0)
    assert parse_faults("reboot-at=700ms").reboot_at == Moment(time_s=0.7)
    assert parse_faults("delay=1.5").delay_s == 1.5


def test_nothing_is_nothing() -> None:
    """An empty text, spaces, stray commas."""
    assert parse_faults("") == parse_faults(" , ") == Faults()


def test_an_unknown_name_is_told_with_the_known_ones() -> None:
    """All problems in one go."""
    with pytest.raises(
        ValueError, match=r"'dorp' is unknown; known are drop.*'drop' wants a probability.*takes no value"
    ):
        parse_faults("dorp=0.3,drop=7,first-lost=2")


@pytest.mark.parametrize(
    "text",
    [
        "drop=x",
        "drop=nan",
        "drop=-0.1",
        "delay=-1",
        "delay=inf",
        "nack=OK",
        "nack=ACCEPTED",
        "alter=-1",
        "second-gcs=fly",
    ],
)
def test_an_impossible_value_is_told(text: str) -> None:
    """With what is wanted."""
    with pytest.raises(ValueError, match="wants"):
        parse_faults(text)


@pytest.mark.parametrize("name", sorted(FAULTS))
def test_every_name_alone_switches_something_on_and_is_in_the_help(name: str) -> None:
    """Each has a value of its own where none is given."""
    assert parse_faults(name) != Faults()
    assert f"  {name} " in fault_help()


def test_faults_in_flight_are_kept_apart_from_those_of_the_radio() -> None:
    """An item, or an item and how much; without a value the usual one."""
    flight = parse_faults("hold-cut=4,gust=5/120m,position-lost,battery-drop=2,crash=7").flight
    assert (flight.hold_cut, flight.battery_drop, flight.crash) == (4, 2, 7)
    assert flight.gust == AtItem(5, 120.0)
    assert flight.position_lost == AtItem(3, 20.0)
    assert not parse_faults("gust,hold-cut").on_the_way
    assert parse_faults("gust,drop=0.1").on_the_way
    for wrong in ("gust=3/0m", "gust=x", "position-lost=3/nan", "crash=-1", "gust=3/1e9m"):
        with pytest.raises(ValueError, match="wants"):
            parse_faults(wrong)
