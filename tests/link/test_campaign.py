"""The campaign of `benchmarks.transfers` in a reduced form, and proof that its judge can find fault."""

import dataclasses

import pytest

from benchmarks import transfer_judge
from benchmarks.transfer_case import VEHICLE, Case, put, transfer
from benchmarks.transfer_cells import CELLS
from benchmarks.transfer_judge import flooding, judge, run_case
from benchmarks.transfers import Row, jobs_of, main, run_jobs
from mavplan.errors import RefusedError
from mavplan.link.codec import Codec
from mavplan.link.protocol import mission_count, mission_item
from mavplan.link.upload import Upload
from mavplan.mission.wire import WireItem
from sitl_mock.faults import FAULTS

RUNS = 500
SEED = 42
BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])


@pytest.mark.parametrize("place", range(len(CELLS)), ids=[cell.name for cell in CELLS])
def test_nothing_untrue_nothing_late_no_flood_and_enough_verified(place):
    jobs = [job for job in jobs_of(RUNS) if job[0] == place]
    rows = {firmware: Row(CELLS[place], firmware) for firmware in CELLS[place].firmwares}
    for (_, firmware, _), result in run_jobs(SEED, jobs):
        assert not result.wrong, (result.wrong, result.case, result.words)
        rows[firmware].add(result)
    for row in rows.values():
        assert not row.too_few, (row.firmware, row.verified_part)


def test_every_fault_of_the_link_that_the_mock_knows_is_in_the_campaign():
    told = ",".join(text for cell in CELLS for text in cell.faults)
    for name in (name for name, fault in FAULTS.items() if not fault.in_flight):
        assert name in told.replace("{up|down}", "up,drop-down"), name


def test_the_same_seed_gives_the_same_results():
    jobs = jobs_of(40)[-12:]
    assert run_jobs(1, jobs) == run_jobs(1, list(reversed(jobs)))[::-1]


def test_every_cell_gets_runs_and_there_are_no_fewer_than_asked_for():
    assert {place for place, _, _ in jobs_of(1)} == set(range(len(CELLS)))
    assert 0 <= len(jobs_of(20_000)) - 20_000 < 2 * len(CELLS)


# -- the judge can find fault ---------------------------------------------------------------------------------


def upload(firmware, faults="", **changes):
    return transfer(Case(firmware, faults, 20, 100.0, 7, **changes))


@BOTH
def test_a_mission_that_is_a_little_different_is_not_verified(firmware):
    """An item of what the vehicle holds changed in one field by the least step that is stored."""
    ended = upload(firmware)
    assert judge(ended).wrong == ()
    held = ended.run.network.stored(0)
    for field, step in (("x", 1), ("z", 0.01), ("param1", 1.0), ("frame", -3), ("command", 1)):
        changed = dataclasses.replace(held[3], **{field: getattr(held[3], field) + step})
        assert not ended.sample.is_held((*held[:3], changed, *held[4:])), field
    assert not ended.sample.is_held(held[:-1])
    assert not ended.sample.is_held((*held, held[-1]))


@BOTH
def test_a_fence_or_a_rally_point_that_is_missing_is_not_held(firmware):
    ended = upload(firmware, areas=True)
    held = ended.run.network.held()
    assert judge(ended).wrong == ()
    assert ended.sample.areas_are_held(held[1], held[2])
    assert not ended.sample.areas_are_held(held[1][:-1], held[2])
    assert not ended.sample.areas_are_held(held[1], ())


@BOTH
def test_a_verified_mission_that_somebody_replaced_is_wrong(firmware):
    ended = upload(firmware)
    place = (0.0, 0.0, 0.0, 0.0, 374_000_000, -1_221_000_000, 30.0)
    put(ended.run.network.autopilot, (WireItem(0, 3, 22, 1, 1, *place),), now=ended.run.network.clock_s)
    assert judge(ended).wrong == (
        "verified, but at the end that is not so",
        "verified, but when all had landed that is not so",
    )


@BOTH
def test_a_refusal_by_a_vehicle_that_took_the_mission_is_wrong(firmware):
    ended = upload(firmware)
    ended.run.session.error = RefusedError("the vehicle keeps its old mission")
    assert len(judge(ended).wrong) == 2


def test_a_session_beyond_its_deadline_is_wrong():
    ended = upload("px4")
    late = dataclasses.replace(ended, run=dataclasses.replace(ended.run, ended_s=100.1))
    assert judge(late).wrong == ("outlived its deadline: 100.100 s",)


def test_an_error_of_no_known_type_is_wrong():
    ended = upload("px4")
    ended.run.session.error = ValueError("no")
    assert judge(ended).wrong[0] == "ended with ValueError('no')"


def test_a_client_that_believes_the_ack_is_found_out(monkeypatch):
    """An upload with the comparison cut out calls an altered mission verified."""
    case = Case("ardupilot", "alter=3", 20, 100.0, 7)
    assert run_case(case).wrong == ()
    monkeypatch.setattr("mavplan.link.store.differences", lambda *_: [])
    assert "verified, but at the end that is not so" in run_case(case).wrong


def test_a_client_that_answers_every_request_is_found_out(monkeypatch):
    """Each copy of a request answered at once: items go out again too soon."""
    case = Case("ardupilot", "dup=1", 20, 100.0, 7)
    assert run_case(case).wrong == ()
    monkeypatch.setattr("mavplan.link.upload.SAME_ITEM_S", 0.0)
    assert any("sent again" in fault for fault in run_case(case).wrong)


def test_a_client_that_sends_ahead_too_fast_is_found_out(monkeypatch):
    """Unasked items every tenth of a second."""
    case = Case("ardupilot", "drop=0.3", 20, 100.0, 7)
    monkeypatch.setattr(Upload, "_repeat_at", lambda self: self._last_send_at + 0.1)
    assert any("sent" in fault for fault in run_case(case).wrong)


def frames(*messages):
    codec = Codec()
    return [(at, codec.encode(message)) for at, message in messages]


def numbered(seq, kind=0):
    return mission_item(VEHICLE, WireItem(seq, 3, 16, 0, 1, 0, 0, 0, 0, 1, 1, 30.0), kind)


def test_flooding_is_an_item_again_or_unasked_within_a_quarter_second_of_its_list():
    count = mission_count(VEHICLE, 3, 0)
    asked = [(0.0, 0, 0), (0.1, 0, 1), (0.12, 0, 1), (0.2, 1, 1)]
    good = frames((0.0, count), (0.0, numbered(0)), (0.1, numbered(1)), (0.2, numbered(1, 1)))
    assert flooding(good, asked) == []
    assert flooding([*good, *frames((0.3, numbered(1)))], asked) == [
        "item 1 of list 0 was sent again after 0.200 s"
    ]
    assert flooding([*good, *frames((0.3, numbered(2)), (0.5, numbered(0)))], asked) == [
        "item 0 of list 0 was sent unasked 0.200 s after another"
    ]
    assert flooding([*good, *frames((0.3, numbered(2)), (0.55, numbered(0)))], asked) == []
    assert flooding([*good, *frames((0.25, count), (0.25, numbered(1)))], asked) == []


def test_the_command_prints_a_table_and_ends_with_1_where_something_is_wrong(monkeypatch, capsys):
    only = ["--runs", "60", "--jobs", "1", "--cell", "dup", "--firmware", "px4"]
    assert main(only) == 0
    printed = capsys.readouterr().out
    assert "| dup " in printed
    assert " 0 wrong, 0 cells with too few verified" in printed
    monkeypatch.setattr(transfer_judge, "_untrue", lambda *_: ["made up"])
    assert main([*only, "--run", "0"]) == 1
    assert "again: --seed 0 --cell 'dup' --firmware px4 --run 0" in capsys.readouterr().out
