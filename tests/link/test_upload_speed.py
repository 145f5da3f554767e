"""The benchmark `benchmarks.upload_speed` in a reduced form: its watch is right, and it can find fault."""

import dataclasses
import itertools
import random

import pytest

from benchmarks import upload_speed, watched_mock
from benchmarks.transfer_case import VEHICLE, put
from benchmarks.transfer_oracle import make_sample
from benchmarks.upload_clients import UploadFailedError, missing, waypoints, wire_items
from benchmarks.upload_speed import CELLS, Cell, Row, main, measure, seconds_of
from benchmarks.watched_mock import Upload, Watched
from mavplan.link.codec import Codec
from mavplan.link.protocol import mission_count, mission_item
from tests.link.harness import LINK, make_network

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])


@BOTH
def test_mavplan_and_mavsdk_upload_to_a_mock_that_measures_them(firmware):
    """None is faster than the vehicle's pace, none gets lost."""
    names = tuple(name for name in ("mavplan", "MAVSDK") if not missing(name))
    cell = Cell(firmware, 10, clients=names)
    took_s = measure(cell, runs=1)
    assert tuple(took_s) == names
    for times in took_s.values():
        (seconds,) = times
        assert cell.least_s <= seconds < 3.0


@BOTH
def test_the_watch_runs_from_the_first_count_to_the_acknowledgement(firmware, monkeypatch, capsys):
    """Another list does not start it, a count that comes again does not start it anew."""
    clock = itertools.count(10.0, 1.0)
    monkeypatch.setattr(watched_mock.time, "monotonic", lambda: now_s)
    network, codec = make_network(firmware), Codec()
    watched = Watched(network)
    sample = make_sample(firmware, 4, random.Random(1))
    fence, count = mission_count(VEHICLE, 0, 1), mission_count(VEHICLE, 4, 0)
    items = [mission_item(VEHICLE, item, 0) for item in wire_items(sample.mission)]
    for message in (fence, count, count, *items):
        now_s = next(clock)
        watched.receive(codec.encode(message), LINK, now_s)
        watched.to_send()
        assert capsys.readouterr().out == ""
    watched.tick(now_s)
    upload = Upload.from_json(capsys.readouterr().out)
    assert upload.seconds == 5.0
    assert repr(upload.stored) == repr(network.stored(0))
    watched.tick(now_s)
    assert capsys.readouterr().out == ""


@BOTH
def test_the_time_of_an_upload_counts_only_where_the_vehicle_holds_the_mission(firmware):
    sample, network = make_sample(firmware, 8, random.Random(2)), make_network(firmware)
    put(network.autopilot, wire_items(sample.mission))
    held = network.stored(0)
    assert seconds_of(Upload(0.25, held), sample, "somebody") == 0.25
    for other in (held[:-1], (*held[:5], dataclasses.replace(held[5], x=held[5].x + 1), *held[6:])):
        with pytest.raises(UploadFailedError, match="by somebody the vehicle holds another mission"):
            seconds_of(Upload(0.25, other), sample, "somebody")


@BOTH
def test_a_file_for_mavproxy_gives_every_place_back_when_it_is_cut_off(firmware):
    """As MAVProxy does it: the integer part of the degrees times 1e7."""
    items = wire_items(make_sample(firmware, 500, random.Random(3)).mission)
    rows = [line.split("\t") for line in waypoints(items).splitlines()[1:]]
    assert [(int(float(row[8]) * 1e7), int(float(row[9]) * 1e7)) for row in rows] == [
        (i.x, i.y) for i in items
    ]


def test_what_is_wanted_is_a_ratio_to_the_fastest_other_or_to_the_round_trips():
    assert Cell("px4", 50).most_s([0.5, 0.4]) == pytest.approx(0.48)
    assert Cell("px4", 50).most_s([]) is None
    assert Cell("px4", 50, paced=False).most_s([0.5, 0.4]) is None
    assert Cell("px4", 50, delay_s=0.05).most_s([0.5, 0.4]) == pytest.approx(1.1 * 52 * 0.1)
    assert not Row(Cell("px4", 50), {"mavplan": [0.47, 9.0], "MAVSDK": [0.5, 0.4]}).too_slow
    assert Row(Cell("px4", 50), {"mavplan": [0.49], "MAVSDK": [0.4], "MAVProxy": [0.6, 0.5]}).too_slow
    assert not Row(Cell("px4", 50), {"mavplan": [0.49]}).too_slow


def test_every_firmware_and_size_is_measured_with_and_without_a_pace_and_from_afar():
    found = {(cell.firmware, cell.items, cell.paced, cell.delay_s) for cell in CELLS}
    ways = [(True, 0.0), (False, 0.0), (True, 0.05)]
    assert found == {(f, i, *way) for f in ("ardupilot", "px4") for i in (50, 500) for way in ways}


def test_the_command_prints_a_table_and_ends_with_1_where_something_is_wrong(monkeypatch, capsys):
    only = ["--only", "PX4 at its pace, 500"]
    monkeypatch.setattr(upload_speed, "measure", lambda *_: {"mavplan": [0.3, 0.4, 9.0], "MAVSDK": [0.35]})
    assert main(only) == 0
    assert "| PX4 at its pace |   500 | 0.300 (0.400) |    0.350 |" in capsys.readouterr().out
    monkeypatch.setattr(upload_speed, "measure", lambda *_: {"mavplan": [0.5], "MAVSDK": [0.35]})
    assert main(only) == 1
    assert "TOO SLOW: PX4 at its pace, 500 items: 0.500 s, wanted 0.420 s" in capsys.readouterr().out

    def fail(*_):
        raise UploadFailedError("the vehicle accepted no mission within 20 s")

    monkeypatch.setattr(upload_speed, "measure", fail)
    assert main(only) == 1
    assert "FAILED: PX4 at its pace, 500 items: the vehicle accepted no mission" in capsys.readouterr().out
    with pytest.raises(SystemExit) as usage:
        main(["--only", "blimp"])
    assert usage.value.code == 2
