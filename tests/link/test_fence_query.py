"""Whether a fence is in force is told after the upload, and never fails one."""

import struct

import pytest
from pymavlink.dialects.v20 import common

from mavplan.errors import RefusedError
from mavplan.link.parameters import ParameterQuery
from mavplan.link.protocol import param_request_read
from mavplan.link.transfer import Pace
from mavplan.mission.geofence import Fence, FenceCircle
from tests.link.fenced import FENCE, fenced, set_parameter
from tests.link.harness import HOME, make_mission, make_network, upload
from tests.link.script import OTHER_STATION, VEHICLE, said

SMALL = Fence((), (FenceCircle(True, HOME.lat_e7, HOME.lon_e7, 200.0),))


def codes(result):
    assert result.verified, result.error
    return {problem.code for problem in result.session.report.warnings}


def test_ardupilots_default_stores_a_fence_and_does_nothing_with_it_and_that_is_said():
    result = upload(fenced("ardupilot", 1), make_network("ardupilot"))
    assert "fence-not-in-force" in codes(result)
    assert result.session.report.fence_force.enforced == ()


def test_ardupilots_radius_in_force_is_warned_about_though_the_mission_has_no_fence():
    network = make_network("ardupilot")
    set_parameter(network, "FENCE_ENABLE", 1)
    result = upload(make_mission("ardupilot", 4), network)
    assert "fence-breach" in codes(result)
    assert result.session.report.fence_force.breached == ("radius",)


def test_a_fence_that_the_vehicle_holds_from_before_is_held_against_a_mission_without_one():
    network = make_network("ardupilot")
    set_parameter(network, "FENCE_ENABLE", 1)
    set_parameter(network, "FENCE_TYPE", 4)
    assert upload(fenced("ardupilot", 1, fence=SMALL), network).verified
    far = upload(make_mission("ardupilot", 4), network)
    assert "fence-breach" in codes(far)
    assert far.session.report.fence_force.breached == ("areas",)
    assert upload(make_mission("ardupilot", 1), network).session.report.fence_force.breached == ()


def test_px4_refuses_to_fly_out_of_the_fence_it_holds_and_says_where():
    network = make_network("px4")
    assert upload(fenced("px4", 1, fence=SMALL), network).verified
    result = upload(make_mission("px4", 4), network)
    assert isinstance(result.error, RefusedError)
    assert "breaches the vehicle's geofence" in str(result.error)


def test_px4_keeps_its_fence_in_force_and_an_action_of_0_switches_it_off():
    network = make_network("px4")
    assert upload(fenced("px4"), network).session.report.fence_force.enforced == ("areas",)
    set_parameter(network, "GF_ACTION", 0)
    assert upload(fenced("px4"), network).session.report.fence_force.enforced == ()


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_a_vehicle_that_tells_no_parameters_is_verified_all_the_same_with_a_warning(firmware, monkeypatch):
    network = make_network(firmware)
    monkeypatch.setattr(network.autopilot._parameters, "read", lambda name, index: [])
    result = upload(fenced(firmware, 1, fence=FENCE), network)
    assert "fence-unknown" in codes(result)
    assert result.session.report.fence_force.enforced is None


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
@pytest.mark.parametrize("seed", range(4))
def test_parameters_survive_a_bad_radio(firmware, seed):
    result = upload(fenced(firmware, 1), make_network(firmware, "drop=0.3,dup=0.2", seed=seed))
    assert "fence-unknown" not in codes(result)


def value(name, raw, kind, by=VEHICLE):
    return said(common.MAVLink_param_value_message(name.encode(), raw, kind, 1, 0), by)


def query(bytewise, **options):
    return ParameterQuery(
        VEHICLE,
        ("GF_ACTION",),
        ("EXTRA",),
        **{"bytewise": bytewise, "pace": Pace(), "now": 0.0, "deadline": 5.0, **options},
    )


@pytest.mark.parametrize(
    ("kind", "layout", "number"),
    [
        (6, "<i", 2),
        (6, "<i", -1),
        (6, "<i", 2_140_000_000),
        (5, "<I", 0xFF80_0001),
        (2, "<bxxx", -3),
        (4, "<hxx", -300),
    ],
)
def test_px4s_integers_are_read_from_their_bytes_also_where_those_are_no_number_as_a_float(
    kind, layout, number
):
    (as_float,) = struct.unpack("<f", struct.pack(layout, number))
    asked = query(True)
    message = value("GF_ACTION", as_float, kind)
    bits = struct.unpack("<I", struct.pack(layout, number))[0]
    if as_float != as_float and not bits & 0x0040_0000:
        frame = bytearray(message.get_msgbuf())
        frame[10:14] = struct.pack(layout, number)
        message._msgbuf = frame  # Python's own packing has made a quiet NaN of it
    asked.receive(message, 0.1)
    assert asked.values == {"GF_ACTION": number}


def test_ardupilots_integers_are_floats():
    asked = query(False)
    asked.receive(value("GF_ACTION", 3.0, 2), 0.1)
    assert asked.values == {"GF_ACTION": 3.0}


def test_other_vehicles_and_other_names_do_not_count():
    asked = query(True)
    asked.receive(value("GF_ACTION", 1.0, 9, OTHER_STATION), 0.1)
    asked.receive(value("GF_SOURCE", 1.0, 9), 0.1)
    assert asked.values == {}


def test_a_name_that_the_vehicle_has_not_is_not_waited_for_but_a_needed_one_is():
    asked = query(True)
    asked.receive(value("GF_ACTION", 1.0, 9), 0.1)
    while (timer := asked.next_timer()) is not None:
        asked.tick(timer)
        last = timer
    assert last < 3.0
    waiting = query(True)
    while (timer := waiting.next_timer()) is not None:
        waiting.tick(timer)
        last = timer
    assert last == 5.0


def test_a_name_of_16_letters_is_asked_for_whole():
    assert said(param_request_read(VEHICLE, "A" * 16)).param_id == "A" * 16
