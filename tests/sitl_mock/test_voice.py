"""Who hears a vehicle's texts, for how long, and in how many pieces."""

import pytest
from pymavlink.dialects.v20 import common as mavlink

from sitl_mock.firmware import FIRMWARES
from sitl_mock.missions import Text
from sitl_mock.telemetry import Schedule
from sitl_mock.voice import Voice
from sitl_mock.wire import Encoder

STATION = "link"


def texts_heard(firmware: str, text: str, *, at_s: float, speed: float = 1.0) -> list[tuple[int, int, str]]:
    """Return id, number and text of what a station hears that last spoke at 0 s by the vehicle's clock."""
    schedule = Schedule({})
    schedule.greet(STATION, 0.0)
    voice = Voice(FIRMWARES[firmware], Encoder(1, 1, None), schedule, speed)
    voice.hear_station(STATION, 0.0)
    voice.reply([Text(6, text)], at_s, at_s)
    parser = mavlink.MAVLink(None)
    heard = [parser.parse_buffer(frame)[0] for _, frame in voice.take()]
    return [(message.id, message.chunk_seq, message.text) for message in heard]


@pytest.mark.parametrize(("speed", "at_s", "heard"), [(1, 2.4, 1), (1, 2.6, 0), (10, 24, 1), (10, 26, 0)])
def test_px4_talks_to_a_station_heard_of_late_by_the_stations_own_clock(speed, at_s, heard):
    assert len(texts_heard("px4", "Takeoff detected\t", at_s=at_s, speed=speed)) == heard


def test_ardupilot_talks_to_whoever_spoke_once():
    assert texts_heard("ardupilot", "Mission: 1 Takeoff", at_s=3600) == [(0, 0, "Mission: 1 Takeoff")]


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_a_long_text_comes_in_pieces_of_one_id(firmware):
    """As recorded from PX4, whose text of 50 letters and a tab takes two."""
    text = "RTL: start return at 40 m (31 m above destination)\t"
    assert texts_heard(firmware, text, at_s=1) == [(1, 0, text[:50]), (1, 1, "\t")]
