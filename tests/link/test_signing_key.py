"""A signing key's file and its time stamp, then ``--signing-key`` on both sides over real sockets."""

import json
import os
import socket

import pytest

from mavplan.errors import InputError
from mavplan.link.codec import Codec
from mavplan.link.protocol import heartbeat
from mavplan.link.signing import RESERVE, timestamp_now
from mavplan.link.signing_key import open_signing, read_key, read_timestamp, timestamp_file
from sitl_mock import signing as mock_signing
from tests.link.test_commands import HOME, free_port, mavplan, mission_file
from tests.sitl_mock.process import mock, port_of

KEY = bytes(range(100, 132))


def key_file(folder, content=KEY, mode=0o600, name="link.key"):
    path = folder / name
    path.write_bytes(content)
    path.chmod(mode)
    return path


@pytest.mark.parametrize(
    "content", [KEY, KEY.hex().encode(), KEY.hex().upper().encode() + b"\r\n", b" \n" * 16]
)
def test_32_bytes_or_64_digits_are_a_key_on_both_sides(tmp_path, content):
    path = key_file(tmp_path, content)
    assert read_key(path) == mock_signing.read_key(str(path)) == (content if len(content) == 32 else KEY)


@pytest.mark.parametrize(
    ("content", "mode", "word"),
    [
        (KEY, 0o640, "mode 0640"),
        (KEY, 0o604, "mode 0604"),
        (KEY, 0o644, "chmod 600"),
        (KEY, 0o400, "mode 0400"),
        (KEY + b"\n", 0o600, "33 bytes"),
        (KEY[:-1], 0o600, "31 bytes"),
        (b"", 0o600, "0 bytes"),
        (KEY.hex()[:-1].encode() + b"g", 0o600, "64 hexadecimal"),
        (KEY.hex().encode() * 100, 0o600, "more than"),
        (bytes(32), 0o600, "zeros"),
        (b"0" * 64, 0o600, "zeros"),
    ],
)
def test_anything_else_is_refused_in_a_sentence_without_the_key(tmp_path, content, mode, word):
    path = key_file(tmp_path, content, mode)
    with pytest.raises(InputError, match=word) as raised:
        read_key(path)
    assert str(path) in str(raised.value)
    assert KEY.hex()[:16] not in str(raised.value)
    assert repr(KEY)[2:10] not in str(raised.value)


def test_what_is_no_file_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe", 0o600)
    for name, word in (("pipe", "no ordinary file"), ("none", "cannot be read"), (".", "cannot be read")):
        with pytest.raises(InputError, match=word):
            read_key(tmp_path / name)


def last_stamp(path):
    with open_signing(path) as ours:
        return int.from_bytes(Codec(signing=ours).encode(heartbeat())[-12:-6], "little")


def test_the_last_time_stamp_is_kept_and_the_next_run_goes_on_after_it(tmp_path):
    path = key_file(tmp_path)
    before = timestamp_now()
    first = last_stamp(path)
    assert first >= before
    assert read_timestamp(timestamp_file(path)) == first
    ahead = first + 10**9  # as if this machine's clock had been set back by three hours
    timestamp_file(path).write_text(f"{ahead}\n")
    assert [last_stamp(path), last_stamp(path)] == [ahead + 1, ahead + 2]
    assert {entry.name for entry in tmp_path.iterdir()} == {"link.key", "link.key.timestamp"}


def test_a_run_that_is_killed_leaves_a_stamp_later_than_any_it_used(tmp_path):
    path = key_file(tmp_path)
    with open_signing(path) as ours:
        Codec(signing=ours).encode(heartbeat())
        assert ours.timestamp < read_timestamp(timestamp_file(path)) <= ours.timestamp + RESERVE


def test_two_runs_at_once_never_take_the_kept_stamp_back(tmp_path):
    path = key_file(tmp_path)
    with open_signing(path), open_signing(path) as second:
        Codec(signing=second).encode(heartbeat())
        used = second.timestamp
    assert read_timestamp(timestamp_file(path)) >= used


@pytest.mark.parametrize("content", ["", "soon", "-5", "1.5", str(2**48), "9" * 50])
def test_a_broken_time_stamp_is_refused_and_not_taken_for_none(tmp_path, content):
    path = key_file(tmp_path)
    timestamp_file(path).write_text(content)
    with pytest.raises(InputError, match="no time stamp"), open_signing(path):
        pass
    assert timestamp_file(path).read_text() == content


def signed_mock(key, *more, firmware="px4"):
    return mock(
        "--firmware",
        firmware,
        "--conn",
        "udpin:127.0.0.1:0",
        "--home",
        HOME,
        "--signing-key",
        str(key),
        *more,
    )


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_a_signed_upload_is_stored_verified_and_downloaded(tmp_path, firmware):
    key, file = key_file(tmp_path), mission_file(tmp_path, firmware)
    with signed_mock(key, firmware=firmware) as (_, (line,)):
        conn = ["--conn", f"udpout:127.0.0.1:{port_of(line)}", "--system", 1, "--signing-key", key]
        up = mavplan("upload", file.name, *conn, "--json", folder=tmp_path)
        down = mavplan("download", *conn, "-o", "held.plan", folder=tmp_path)
    assert (up.returncode, down.returncode) == (0, 0), up.stderr + down.stderr
    told = json.loads(up.stdout)
    assert (told["outcome"], told["warnings"]) == ("verified", [])
    assert (told["opaque_id"] is not None) is (firmware == "px4")
    assert read_timestamp(timestamp_file(key)) > 0


@pytest.mark.parametrize("other", [KEY[::-1], None])
def test_a_wrong_or_missing_key_on_the_vehicle_is_no_link_and_the_dropped_frames_are_told(tmp_path, other):
    file, key = mission_file(tmp_path, "px4"), key_file(tmp_path)
    port = free_port(socket.SOCK_DGRAM)
    theirs = ["--firmware", "px4", "--conn", f"udpout:127.0.0.1:{port}", "--home", HOME]
    if other:
        theirs += ["--signing-key", str(key_file(tmp_path, other, name="other.key"))]
    with mock(*theirs):
        conn = ["--conn", f"udpin:127.0.0.1:{port}", "--timeout", 3, "--signing-key", key]
        up = mavplan("upload", file.name, *conn, folder=tmp_path)
    assert up.returncode == 3
    assert up.stderr.count("\n") == 1
    assert ("with a wrong signature" if other else "without a signature") in up.stderr
    assert "dropped" in up.stderr


def test_a_vehicle_that_wants_signatures_is_told_of_when_it_answers_nothing(tmp_path):
    file = mission_file(tmp_path, "px4")
    with signed_mock(key_file(tmp_path)) as (_, (line,)):
        # PX4 keeps sending to whoever called; the mock hears us only as an address.
        conn = ["--conn", f"udpout:127.0.0.1:{port_of(line)}", "--timeout", 4]
        up = mavplan("upload", file.name, *conn, folder=tmp_path)
    assert up.returncode == 5
    assert "--signing-key" in up.stderr


def test_a_signed_upload_over_a_radio_that_doubles_and_loses_is_verified(tmp_path):
    key, file = key_file(tmp_path), mission_file(tmp_path, "ardupilot")
    with signed_mock(key, "--fault", "dup=0.5,drop=0.1", firmware="ardupilot") as (_, (line,)):
        conn = ["--conn", f"udpout:127.0.0.1:{port_of(line)}", "--system", 1, "--signing-key", key]
        up = mavplan("upload", file.name, *conn, "--json", folder=tmp_path)
    assert up.returncode == 0, up.stderr
    assert "with an old time stamp" in json.loads(up.stdout)["warnings"][0]


def test_a_key_that_others_may_read_is_bad_usage_before_anything_is_opened(tmp_path):
    file, key = mission_file(tmp_path, "px4"), key_file(tmp_path, mode=0o644)
    up = mavplan(
        "upload", file.name, "--conn", "udpin:127.0.0.1:14550", "--signing-key", key, folder=tmp_path
    )
    assert up.returncode == 2
    assert "0644" in up.stderr
