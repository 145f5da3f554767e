"""The recording: never over another one, whole to its last frame, and no reason to end a flight."""

from datetime import UTC, datetime
from pathlib import Path

import pytest

from mavplan.errors import InputError
from mavplan.flight.recording import Recording, recording_path
from mavplan.link.codec import Codec
from mavplan.link.protocol import heartbeat
from mavplan.track.tlog import TlogFrames


def test_it_is_beside_the_mission_with_its_time():
    at = datetime(2025, 8, 18, 14, 30, 5, tzinfo=UTC)
    assert recording_path(Path("out/valley.plan"), at) == Path("out/valley.20250818T143005Z.tlog")


def test_every_frame_is_in_the_file_as_soon_as_it_is_written(tmp_path):
    path = tmp_path / "x.tlog"
    codec = Codec()
    with Recording(path) as recording:
        for number in range(5):
            recording.write(1_000_000 * number, codec.encode(heartbeat()))
            frames = list(TlogFrames(path.read_bytes()))
            assert [frame.time_us for frame in frames] == [1_000_000 * n for n in range(number + 1)]
    assert recording.frames == 5


def test_a_file_that_is_there_is_never_written_over(tmp_path):
    path = tmp_path / "x.tlog"
    path.write_bytes(b"old")
    with pytest.raises(InputError, match="never written over"):
        Recording(path)
    assert path.read_bytes() == b"old"


def test_a_full_disk_ends_the_recording_and_nothing_else(tmp_path):
    recording = Recording(tmp_path / "x.tlog")
    recording._file.close()
    with Path("/dev/full").open("wb", buffering=0) as recording._file:
        recording.write(0, b"\xfd" * 20)
        recording.write(0, b"\xfd" * 20)
    assert recording.frames == 0
    assert "No space left" in recording.failed


def test_one_that_nobody_needs_is_taken_away(tmp_path):
    recording = Recording(tmp_path / "x.tlog")
    recording.discard()
    assert list(tmp_path.iterdir()) == []
