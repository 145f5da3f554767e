"""ArduPilot's onboard log (``.bin``) to a `Track`: POS, ARM, EV, MODE, MISE and MSG; everything else is stepped over.

pymavlink's DFReader is the reference in the tests. It is not used here: it wants a file, prints about damage, and
reads a whole log message by message (17 s for 79 MB) where there was no GPS week to set its clock by.

A log begins with the formats of its messages, each a record like the others: 0xA3 0x95, type, then packed fields
(https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html). MISSION_ITEM_REACHED is not logged;
the texts that go with it are: "Reached command #3" at the end of an item, its number counting home as 0.
"""

import math
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from mavplan.errors import InputError, Problem
from mavplan.track.model import Track
from mavplan.track.runs import CLOCK_SLIP_S, Run, flight_track

HEAD = b"\xa3\x95"
_FMT = 128
_FMT_LENGTH = 89
_WANTED = frozenset({"POS", "ARM", "EV", "MODE", "MISE", "MSG"})
_CODES = {
    "a": "64s", "b": "b", "B": "B", "h": "h", "H": "H", "i": "i", "I": "I", "f": "f", "d": "d", "n": "4s", "N": "16s",
    "Z": "64s", "c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "M": "B", "q": "q", "Q": "Q", "g": "e",
}  # fmt: skip
"""Letters of a format, and how struct unpacks them; L is degrees times 1e7."""

_EV_ARMED, _EV_DISARMED = 10, 11
_AUTO = (3, 27)
"""ArduCopter's modes AUTO and AUTO_RTL."""
_REACHED = re.compile(rb"Reached command #(\d{1,5})")


@dataclass(frozen=True, slots=True)
class _Format:
    """How one kind of message is packed."""

    name: str
    length: int
    columns: tuple[str, ...]
    unpacker: struct.Struct

    def values(self, data: bytes, at: int) -> dict[str, Any]:
        """Return the fields of the record that begins here."""
        return dict(zip(self.columns, self.unpacker.unpack_from(data, at + 3), strict=True))


@dataclass
class Records:
    """The wanted messages of a log in their order, once: an iterator that knows afterwards what it left out."""

    data: bytes
    skipped_bytes: int = 0
    cut_bytes: int = 0
    _lengths: list[int] = field(default_factory=lambda: [0] * 256)
    _formats: dict[int, _Format] = field(default_factory=dict)

    def __iter__(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """Give name and fields of each."""
        data, lengths, formats = self.data, self._lengths, self._formats
        lengths[_FMT] = _FMT_LENGTH
        at, end = 0, len(data)
        while at + 3 <= end:
            length = lengths[data[at + 2]] if data[at] == HEAD[0] and data[at + 1] == HEAD[1] else 0
            if not length:
                at = self._resync(at)
                continue
            if at + length > end:
                break
            kind = data[at + 2]
            if kind == _FMT:
                self._learn(data[at + 3 : at + _FMT_LENGTH])
            elif kind in formats:
                yield formats[kind].name, formats[kind].values(data, at)
            at += length
        self.cut_bytes = end - at

    def _resync(self, at: int) -> int:
        """Return where the next record seems to begin: of a known kind, another one or the end behind it."""
        place = at
        while True:
            place = self.data.find(HEAD, place + 1)
            if place < 0 or place + 3 > len(self.data):
                self.skipped_bytes += len(self.data) - at
                return len(self.data)
            length = self._lengths[self.data[place + 2]]
            behind = self.data[place + length : place + length + 2]
            if length and HEAD.startswith(behind):
                self.skipped_bytes += place - at
                return place

    def _learn(self, body: bytes) -> None:
        """Take note of a format; one that cannot be right is left out."""
        kind, length, name, letters, columns = struct.unpack("<BB4s16s64s", body)
        if kind == _FMT or length < 3:
            return
        self._lengths[kind] = length
        self._formats.pop(kind, None)
        named = _text(name)
        if named not in _WANTED:
            return
        try:
            unpacker = struct.Struct("<" + "".join(_CODES[letter] for letter in _text(letters)))
        except KeyError:
            return
        labels = tuple(_text(columns).split(","))
        if unpacker.size == length - 3 and len(labels) == len(_text(letters)):
            self._formats[kind] = _Format(named, length, labels, unpacker)


def _text(raw: bytes) -> str:
    return raw.split(b"\0", 1)[0].decode("ascii", "replace")


def read_bin(data: bytes, label: str) -> Track:
    """Return the flight in an onboard log of ArduPilot.

    Raises
    ------
    InputError
        Nothing in it can be used.
    """
    records = Records(data)
    runs = [Run()]
    newest_s = -math.inf
    for name, values in records:
        time_us = values.get("TimeUS")
        if not isinstance(time_us, int):
            continue
        time_s = time_us / 1e6
        if time_s < newest_s - CLOCK_SLIP_S:
            runs.append(Run())
            newest_s = time_s
        newest_s = max(newest_s, time_s)
        _note(runs[-1], name, values, time_s)
    for run in runs:
        if run.armed and not run.armed[0][1]:
            # Logging begins when the vehicle arms, by default: its first word may be that it no longer is.
            run.armed.insert(0, (-math.inf, True))
    notes = list(_damages(records, label))
    if len(data) <= _FMT_LENGTH:
        raise InputError([Problem(label, "is empty, or ends before its first message", "empty"), *notes])
    return flight_track(runs, label, notes, autopilot="ardupilot")


def _damages(records: Records, label: str) -> Iterator[Problem]:
    if records.skipped_bytes:
        message = f"{records.skipped_bytes:,} bytes are no messages of a log and are left out"
        yield Problem(label, message, "damaged", "warning")
    if records.cut_bytes:
        message = f"the last {records.cut_bytes:,} bytes are an unfinished message: the log was cut there"
        yield Problem(label, message, "cut", "warning")


def _note(run: Run, name: str, values: dict[str, Any], time_s: float) -> None:
    """Note what one message says; a field that a firmware does not log is as if the message were not there."""
    match name, values:
        case "POS", {"Lat": int(lat_e7), "Lng": int(lon_e7), "RelHomeAlt": float(above_m)}:
            run.positions.append((time_s, lat_e7 / 1e7, lon_e7 / 1e7, above_m))
        case "ARM", {"ArmState": int(state)}:
            run.armed.append((time_s, bool(state)))
        case "EV", {"Id": int(event)} if event in (_EV_ARMED, _EV_DISARMED):
            run.armed.append((time_s, event == _EV_ARMED))
        case "MODE", {"Mode": int(mode)}:
            run.mission.append((time_s, mode in _AUTO))
        case "MISE", {"CNum": int(seq)}:
            run.current.append((time_s, seq))
        case "MSG", {"Message": bytes(text)} if found := _REACHED.match(text):
            run.reached.append((time_s, int(found[1])))
