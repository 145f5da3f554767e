"""The mock against recordings of real autopilots: the station's frames go in at their times, the same must come out."""

import struct
from pathlib import Path
from typing import Any

import pytest

from sitl_mock.autopilot import Autopilot
from sitl_mock.firmware import FIRMWARES
from sitl_mock.wire import Encoder, Parser, frame_size

from .rig import heartbeat

CAPTURES = Path(__file__).resolve().parents[2] / "../shared/captures"
STATION = 255
HOME = (37.4, -122.1, 10.1)
TRANSFER = {"MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_COUNT", "MISSION_ACK", "MISSION_ITEM_INT"}
TRANSFER_TEXTS = ("Flight plan", "Fence", "Only", "Mission upload", "IGN MISSION")

pytestmark = pytest.mark.skipif(
    not CAPTURES.is_dir(), reason=f"no recordings of real autopilots at {CAPTURES}"
)

RECORDINGS = [
    "ardupilot_clear_all_and_nospace",
    "ardupilot_flight_loiter",
    "ardupilot_upload_download",
    "ardupilot_upload_gcs_silent",
    "ardupilot_upload_rejected_nan_param4",
    "px4_flight",
    "px4_flight_full",
    "px4_upload_download",
]


def recorded(name: str) -> list[tuple[float, bytes]]:
    """Frames of a .tlog with seconds from its beginning."""
    data = (CAPTURES / f"{name}.tlog").read_bytes()
    frames, at = [], 0
    while at < len(data):
        (microseconds,) = struct.unpack(">Q", data[at : at + 8])
        size = frame_size(data[at + 8 : at + 11])
        assert size is not None
        frames.append((microseconds / 1e6, data[at + 8 : at + 8 + size]))
        at += 8 + size
    return [(time - frames[0][0], frame) for time, frame in frames]


def messages(frames: list[tuple[float, bytes]]) -> list[tuple[float, Any, bytes]]:
    parser = Parser()
    return [(time, message, frame) for time, frame in frames for message in parser.feed(frame)]


class Replay:
    """A mock that is fed a recording's station."""

    def __init__(self, name: str, *, first: str | None = None) -> None:
        self.vehicle = Autopilot(FIRMWARES[name.split("_", maxsplit=1)[0]], home=HOME)
        self.said: list[tuple[float, bytes]] = []
        frames = recorded(name)
        self.vehicle.tick(-1.0)
        if first is not None:  # what the real vehicle already held
            ready = [frame for _, frame in recorded(first) if frame[5] == STATION][:9]
            for frame in ready:
                self.vehicle.receive(frame, "station", -1.0)
            self.vehicle.to_send()
        beats = Encoder(STATION, 190)
        # Heartbeats were thinned out of the recordings; the vehicle's texts depend on them.
        alive = [(second * 1.0, beats.encode(heartbeat())) for second in range(int(frames[-1][0]) + 1)]
        for time, frame in sorted(
            [*alive, *(each for each in frames if each[1][5] == STATION)], key=lambda each: each[0]
        ):
            self._run_to(time)
            self.vehicle.receive(frame, "station", time)
            self._collect(time)
        self._run_to(frames[-1][0])

    def _run_to(self, time: float) -> None:
        while (timer := self.vehicle.next_timer()) is not None and timer < time:
            self.vehicle.tick(timer)
            self._collect(timer)

    def _collect(self, time: float) -> None:
        self.said += [(time, frame) for _, frame in self.vehicle.to_send() if time >= 0]


def transfer(frames: list[tuple[float, bytes]]) -> list[tuple[float, str, bytes]]:
    """The vehicle's messages of mission transfers: time, text and payload."""
    kept = []
    for time, message, frame in messages([each for each in frames if each[1][5] == 1]):
        name = message.get_type()
        if name in TRANSFER or (name == "STATUSTEXT" and message.text.startswith(TRANSFER_TEXTS)):
            kept.append((time, str(message), frame[10:-2]))
    return kept


@pytest.mark.parametrize("name", RECORDINGS)
def test_the_mock_answers_as_the_real_autopilot_did(name: str) -> None:
    """The same messages with the same payloads in the same order: opaque ids and texts too."""
    first = "ardupilot_upload_download" if "rejected" in name else None
    real, mock = transfer(recorded(name)), transfer(Replay(name, first=first).said)
    assert [text for _, text, _ in mock] == [text for _, text, _ in real]
    assert [payload for _, _, payload in mock] == [payload for _, _, payload in real]


@pytest.mark.parametrize("name", RECORDINGS)
def test_the_mock_answers_when_the_real_autopilot_did(name: str) -> None:
    """Within 20 % of the time since the message before, or 20 ms."""
    first = "ardupilot_upload_download" if "rejected" in name else None
    real, mock = transfer(recorded(name)), transfer(Replay(name, first=first).said)
    for n in range(1, min(len(real), len(mock))):
        took_real, took_mock = real[n][0] - real[n - 1][0], mock[n][0] - mock[n - 1][0]
        assert took_mock == pytest.approx(took_real, rel=0.2, abs=0.02), real[n][1]


def test_px4_judges_each_mission_as_the_real_one_did() -> None:
    """Total, state and mission id of MISSION_CURRENT after each upload of the recording, in order."""

    def verdicts(frames: list[tuple[float, bytes]]) -> list[bytes]:
        seen: list[bytes] = []
        for time, message, frame in messages(frames):
            if (
                message.get_type() == "MISSION_CURRENT"
                and time > 1.3
                and (not seen or seen[-1] != frame[10:-2])
            ):
                seen.append(frame[10:-2])
        return seen

    name = "px4_upload_download"
    assert verdicts(Replay(name).said) == verdicts(recorded(name))


def test_the_heartbeat_on_the_ground_is_the_real_one() -> None:
    """Type, autopilot, base mode and custom mode of both."""
    for name, index in (("ardupilot_upload_download", 0), ("px4_upload_download", 0)):
        beats = [m for _, m, f in messages(recorded(name)) if m.get_type() == "HEARTBEAT" and f[5] == 1]
        mocks = [m for _, m, _ in messages(Replay(name).said) if m.get_type() == "HEARTBEAT"]
        assert str(mocks[index]) == str(beats[index])
