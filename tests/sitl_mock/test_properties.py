"""What must hold whatever arrives: no crash, PX4's lists whole, no list above its capacity."""

from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common as mavlink

from sitl_mock.autopilot import Autopilot
from sitl_mock.faults import FAULTS, parse_faults
from sitl_mock.firmware import FIRMWARES
from sitl_mock.network import FaultyNetwork
from sitl_mock.wire import Encoder, Parser

from .rig import HOME, ack, clear, command, count, heartbeat, item, request, request_list

firmwares = st.sampled_from(sorted(FIRMWARES))
kinds = st.sampled_from([0, 0, 0, 1, 2, 255, 7])
seqs = st.integers(0, 6)
floats = st.floats(width=32)
quick = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])


@st.composite
def items(draw: st.DrawFn) -> Any:
    kind = draw(kinds)
    numbers = {0: [16, 19, 20, 22, 177, 178, 31000], 1: [5000, 5001, 5002, 5003], 2: [5100]}.get(kind, [16])
    return item(
        draw(seqs),
        draw(st.sampled_from(numbers)),
        draw(st.sampled_from([0, 2, 3, 5, 6, 10, 200])),
        current=draw(st.sampled_from([0, 0, 1, 2])),
        p1=draw(st.one_of(st.sampled_from([0.0, 3.0, 8.0]), floats)),
        p4=draw(st.one_of(st.just(0.0), floats)),
        x=draw(st.integers(-(2**31), 2**31 - 1)),
        y=draw(st.integers(-(2**31), 2**31 - 1)),
        z=draw(floats),
        kind=kind,
    )


messages = st.one_of(
    items(),
    st.builds(count, st.integers(0, 8), kinds),
    st.builds(request, seqs, kinds),
    st.builds(request_list, kinds),
    st.builds(ack, st.integers(0, 15), kinds),
    st.builds(clear, kinds),
    st.builds(command, st.sampled_from([510, 511, 512, 520, 400]), floats, floats),
    st.just(heartbeat()),
    st.builds(lambda seq: mavlink.MAVLink_mission_set_current_message(1, 1, seq), seqs),
)
senders = st.sampled_from([("a", 255), ("a", 254), ("b", 255)])
steps = st.lists(st.tuples(messages, senders, st.sampled_from([0.0, 0.0, 0.01, 0.3, 1.2, 6.0])), max_size=40)


def out_parses(vehicle: Any, parser: Parser) -> list[Any]:
    """Every frame that leaves is a whole, good MAVLink 2 message."""
    left = vehicle.to_send()
    parsed = [message for _, frame in left for message in parser.feed(frame)]
    assert len(parsed) == len(left)
    return parsed


@quick
@given(firmwares, st.lists(st.tuples(st.binary(max_size=80), st.floats(0, 3)), max_size=30))
def test_random_bytes_never_crash_it(firmware: str, chunks: list[tuple[bytes, float]]) -> None:
    """Nor do they put anything into its lists."""
    vehicle, parser, now = Autopilot(FIRMWARES[firmware], home=HOME), Parser(), 0.0
    for data, pause in chunks:
        now += pause
        vehicle.receive(data, "radio", now)
        vehicle.receive(b"\xfd" + data, "radio", now)
        out_parses(vehicle, parser)
    assert all(vehicle.stored(kind) == () for kind in (0, 1, 2))


@quick
@given(firmwares, steps, st.integers(2, 8))
def test_random_messages_never_crash_it_nor_overfill_it(firmware: str, script: Any, capacity: int) -> None:
    """Stored counts stay within the capacity; timers lie ahead; every frame is good."""
    vehicle, parser, now = Autopilot(FIRMWARES[firmware], home=HOME, capacity=capacity), Parser(), 0.0
    for message, (link, system), pause in script:
        now += pause
        vehicle.receive(Encoder(system, 190).encode(message), link, now)
        out_parses(vehicle, parser)
        assert len(vehicle.stored()) <= capacity
        assert len(vehicle.stored(1)) <= FIRMWARES[firmware].capacity[1]
        assert len(vehicle.stored(2)) <= FIRMWARES[firmware].capacity[2]
        timer = vehicle.next_timer()
        assert (timer is None) == (vehicle.killed_by is not None)
        assert timer is None or timer >= now - 1e-9


@quick
@given(steps)
def test_px4_stays_atomic(script: Any) -> None:
    """A list changes only with an accepting ACK of that list, and then is as long as its COUNT said."""
    vehicle, parser, now = Autopilot(FIRMWARES["px4"], home=HOME), Parser(), 0.0
    for message, (link, system), pause in script:
        now += pause
        before = {
            kind: [stored.numbered(0, current=0) for stored in vehicle.stored(kind)] for kind in (0, 1, 2)
        }
        vehicle.receive(Encoder(system, 190).encode(message), link, now)
        accepted = {
            answer.mission_type
            for answer in out_parses(vehicle, parser)
            if answer.get_type() == "MISSION_ACK" and answer.type == 0
        }
        for kind, items_before in before.items():
            if kind not in accepted and 255 not in accepted:
                assert repr([stored.numbered(0, current=0) for stored in vehicle.stored(kind)]) == repr(
                    items_before
                )


@quick
@given(firmwares, steps, st.lists(st.sampled_from(sorted(FAULTS)), max_size=4), st.integers(0, 1000))
def test_no_fault_crashes_it_or_stops_its_clock(
    firmware: str, script: Any, names: list[str], seed: int
) -> None:
    """Whatever is switched on, ticks come to an end and frames are whole or spoilt, never torn."""
    vehicle = FaultyNetwork(Autopilot(FIRMWARES[firmware], home=HOME), parse_faults(",".join(names)), seed)
    now = 0.0
    for message, (link, system), pause in script:
        now += pause
        vehicle.receive(Encoder(system, 190).encode(message), link, now)
        for _ in range(50):
            timer = vehicle.next_timer()
            if timer is None or timer > now:
                break
            vehicle.tick(now)
        else:
            raise AssertionError("the clock stands still")
        assert all(len(frame) >= 8 for _, frame in vehicle.to_send())
