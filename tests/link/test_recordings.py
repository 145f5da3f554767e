"""Real autopilots' recorded sessions played to the client: it says what the recorded ground station said."""

import math
from pathlib import Path

import pytest

from mavplan.link.codec import Codec
from mavplan.link.download import Download, DownloadEnd
from mavplan.link.manners import MANNERS
from mavplan.link.protocol import GROUND, Address, received_item
from mavplan.link.upload import Upload, UploadEnd
from tests.link.recordings import frames_of

CAPTURES = Path(__file__).resolve().parents[2] / "../shared/captures"
pytestmark = pytest.mark.skipif(
    not CAPTURES.is_dir(), reason="the recordings of real autopilots are not here"
)
VEHICLE = Address(1, 1)


def conversation(name, kind):
    """The mission messages of one type, with their time and whether the ground station sent them."""
    found = []
    for time, frame in frames_of(CAPTURES / f"{name}.tlog"):
        for message in Codec().decode(frame, 0.0):
            if message.get_type().startswith("MISSION_") and getattr(message, "mission_type", None) == kind:
                found.append((time, message.get_srcSystem() == 255, message))
    return found


def parts(talk):
    """Split a conversation where the ground station opens a transfer."""
    found = []
    for time, ours, message in talk:
        if ours and message.get_type() in {"MISSION_COUNT", "MISSION_REQUEST_LIST"}:
            found.append([])
        if found:
            found[-1].append((time, ours, message))
    return found


def key(message):
    """What must be the same: type, number, result, fields. NaN equals NaN."""
    fields = [getattr(message, name) for name in message.get_fieldnames()]
    return message.get_type(), *(
        "nan" if isinstance(value, float) and math.isnan(value) else value for value in fields
    )


def replay(transfer, talk):
    """Feed the vehicle's words at their times; return what the client said and what the recording says."""
    said, recorded = [], []
    codec, listener = Codec(), Codec()
    start = talk[0][0]
    transfer.tick(start)
    for time, ours, message in talk:
        if ours:
            recorded.append(key(message))
        else:
            transfer.receive(message, time)
        # as bytes, so that numbers are rounded as they are in the recording
        said += [key(m) for sent in transfer.to_send() for m in listener.decode(codec.encode(sent), time)]
    return said, recorded


def items_of(talk):
    found = {m.seq: received_item(m) for _, ours, m in talk if ours and m.get_type() == "MISSION_ITEM_INT"}
    count = next(m.count for _, ours, m in talk if ours and m.get_type() == "MISSION_COUNT")
    filler = found[min(found)] if found else None
    return [found.get(seq, filler) for seq in range(count)]


@pytest.mark.parametrize(
    ("name", "autopilot", "kind", "part"),
    [
        ("ardupilot_upload_download", "ardupilot", 0, 0),
        ("ardupilot_upload_download", "ardupilot", 1, 0),
        ("ardupilot_upload_download", "ardupilot", 2, 0),
        ("ardupilot_flight_loiter", "ardupilot", 0, 0),
        ("px4_upload_download", "px4", 0, 0),
        ("px4_flight", "px4", 0, 0),
        ("px4_flight_full", "px4", 0, 0),
    ],
)
def test_an_accepted_upload_goes_word_for_word_as_recorded(name, autopilot, kind, part):
    talk = parts(conversation(name, kind))[part]
    start = talk[0][0]
    transfer = Upload(
        items_of(talk), MANNERS[autopilot], VEHICLE, GROUND, kind, now=start, deadline=start + 60
    )
    said, recorded = replay(transfer, talk)
    assert said == recorded
    assert transfer.outcome.end is UploadEnd.ACCEPTED
    assert (transfer.opaque_id is not None) == (autopilot == "px4")


@pytest.mark.parametrize(
    ("name", "autopilot", "kind"),
    [
        ("ardupilot_upload_download", "ardupilot", 0),
        ("ardupilot_upload_download", "ardupilot", 1),
        ("ardupilot_upload_download", "ardupilot", 2),
        ("ardupilot_upload_rejected_nan_param4", "ardupilot", 0),
        ("px4_upload_download", "px4", 0),
    ],
)
def test_a_download_goes_word_for_word_as_recorded(name, autopilot, kind):
    talk = parts(conversation(name, kind))[1]
    start = talk[0][0]
    transfer = Download(MANNERS[autopilot], VEHICLE, GROUND, kind, now=start, deadline=start + 60)
    said, recorded = replay(transfer, talk)
    assert said == recorded
    assert transfer.outcome.end is DownloadEnd.COMPLETE


@pytest.mark.parametrize(
    ("name", "autopilot", "part", "result", "seq"),
    [("ardupilot_upload_rejected_nan_param4", "ardupilot", 0, 9, 3), ("px4_upload_download", "px4", 3, 3, 1)],
)
def test_a_refused_item_ends_as_recorded_with_its_number(name, autopilot, part, result, seq):
    talk = parts(conversation(name, 0))[part]
    start = talk[0][0]
    transfer = Upload(items_of(talk), MANNERS[autopilot], VEHICLE, GROUND, now=start, deadline=start + 60)
    said, recorded = replay(transfer, talk)
    assert said == recorded
    assert (transfer.outcome.end, transfer.outcome.result, transfer.outcome.seq) == (
        UploadEnd.REFUSED,
        result,
        seq,
    )


def test_ardupilots_time_out_after_our_silence_is_followed_by_a_new_upload():
    """The recorded ground station never answers; its requests are withheld from the client until the last word."""
    talk = conversation("ardupilot_upload_gcs_silent", 0)
    last_time, _, last = talk[-1]
    assert last.get_type() == "MISSION_ACK"
    item = received_item(conversation("ardupilot_upload_download", 0)[2][2])
    transfer = Upload([item] * 8, MANNERS["ardupilot"], VEHICLE, GROUND, now=0.0, deadline=60.0)
    transfer.tick(0.0)
    transfer.receive(talk[1][2], 0.1)
    transfer.receive(last, last_time)
    transfer.to_send()
    transfer.tick(transfer.next_timer())
    assert [message.get_type() for message in transfer.to_send()] == ["MISSION_COUNT"]
