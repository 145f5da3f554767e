"""PX4's onboard log (``.ulg``) to a `Track`, by pyulog, which PX4's own project keeps."""

import contextlib
import io
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mavplan.errors import InputError, Problem
from mavplan.track.model import Track
from mavplan.track.runs import Run, flight_track

MAGIC = b"ULog\x01\x12\x35"
_TOPICS = ("vehicle_global_position", "home_position", "vehicle_status", "mission_result")
MAX_FIELDS, MAX_DEPTH = 20_000, 20
"""More fields in a message, or formats nested deeper, are no log of PX4."""
MOST_READINGS = 20
"""A log is given up when so many times its size was read: a good one is read once."""
_ARMED = 2
"""vehicle_status.arming_state."""
_AUTO_MISSION = 3
"""vehicle_status.nav_state."""


def read_ulg(data: bytes, label: str) -> Track:
    """Return the flight in an onboard log of PX4.

    Raises
    ------
    InputError
        Nothing in it can be used.
    """
    from pyulog import ULog

    try:
        with contextlib.redirect_stdout(io.StringIO()):
            _check_formats(ULog(_Bounded(data), parse_header_only=True).message_formats)
            log = ULog(_Bounded(data), list(_TOPICS))
        topics = {name: _topic(log, name) for name in _TOPICS}
    except Exception as error:  # a foreign reader on a damaged file: it raises whatever it comes to
        message = f"pyulog cannot read it ({type(error).__name__.lstrip('_')}): it is damaged or no ULog"
        raise InputError([Problem(label, message, "unreadable")]) from error
    notes = list(_damages(log, label))
    run = Run()
    _add_positions(run, topics, label, notes)
    status = topics["vehicle_status"]
    run.armed += _pairs(status, "arming_state", _ARMED)
    run.mission += _pairs(status, "nav_state", _AUTO_MISSION)
    result = topics["mission_result"]
    for events, name in ((run.reached, "seq_reached"), (run.current, "seq_current")):
        if name in result:
            events += [
                (time_s, seq)
                for time_s, seq in zip(_seconds(result).tolist(), result[name].tolist(), strict=True)
                if seq >= 0
            ]
    return flight_track([run], label, notes, autopilot="px4")


class _ReadTooOftenError(Exception):
    """Nothing that pyulog would catch."""


class _Bounded(io.BytesIO):
    """A file that ends a reader which goes over it again and again: pyulog does, for ever, on some damaged logs."""

    def __init__(self, data: bytes) -> None:
        super().__init__(data)
        self._left = MOST_READINGS * len(data) + 10_000

    def read(self, size: int | None = -1, /) -> bytes:
        """Read as any file does, until too much was read."""
        found = super().read(size)
        self._left -= max(len(found), 1)
        if self._left < 0:
            raise _ReadTooOftenError
        return found


def _check_formats(formats: dict[str, Any]) -> None:
    """Raise a ValueError where formats nested in each other would fill the memory: pyulog flattens them."""
    fields: dict[str, int] = {}

    def count(name: str, depth: int) -> int:
        if depth > MAX_DEPTH:
            raise ValueError("formats nested without end")
        if name not in fields:
            found = formats.get(name)
            parts = found.fields if found is not None else ()
            fields[name] = sum(max(number, 1) * count(kind, depth + 1) for kind, number, _ in parts) or 1
        if fields[name] > MAX_FIELDS:
            raise ValueError("a message with too many fields")
        return fields[name]

    for name in formats:
        count(name, 0)


_Topic = dict[str, NDArray[Any]]


def _topic(log: Any, name: str) -> _Topic:
    """Return the columns of a topic's first instance, empty where it was not logged."""
    found = [one for one in log.data_list if one.name == name and "timestamp" in one.data]
    return dict(min(found, key=lambda one: one.multi_id).data) if found else {}


def _seconds(topic: _Topic) -> NDArray[np.float64]:
    return topic["timestamp"].astype(np.float64) / 1e6


def _pairs(topic: _Topic, name: str, value: int) -> Iterator[tuple[float, bool]]:
    """Yield when a state was logged and whether it was this one."""
    if name in topic:
        yield from zip(_seconds(topic).tolist(), (topic[name] == value).tolist(), strict=True)


def _damages(log: Any, label: str) -> Iterator[Problem]:
    if log.file_corruption:
        yield Problem(label, "is damaged: pyulog left some of it out", "damaged", "warning")
    if log.dropouts:
        lost_s = sum(dropout.duration for dropout in log.dropouts) / 1e3
        message = f"the vehicle could not write its log {len(log.dropouts):,} times, {lost_s:,.1f} s in all"
        yield Problem(label, message, "dropouts", "warning")


def _add_positions(run: Run, topics: dict[str, _Topic], label: str, notes: list[Problem]) -> None:
    """Add positions above the home that was known at each moment."""
    place = topics["vehicle_global_position"]
    if not {"lat", "lon", "alt"} <= place.keys() or not len(place["lat"]):
        return
    time_s = _seconds(place)
    home_m = _home_m(topics["home_position"], time_s)
    if home_m is None:
        message = "does not say where home is: heights are taken above the first position"
        notes.append(Problem(label, message, "no-home", "warning"))
        home_m = np.full(len(time_s), place["alt"][0])
    with np.errstate(invalid="ignore"):  # damage may have made any bits of a number
        columns = (time_s, place["lat"], place["lon"], place["alt"] - home_m)
        run.positions += zip(*(column.astype(np.float64).tolist() for column in columns), strict=True)


def _home_m(home: _Topic, time_s: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the height of home above mean sea level at each moment, None where it was never known."""
    if "alt" not in home:
        return None
    known = home["valid_alt"] != 0 if "valid_alt" in home else np.ones(len(home["alt"]), dtype=bool)
    known &= np.isfinite(home["alt"])
    if not known.any():
        return None
    order = np.argsort(_seconds(home)[known], kind="stable")
    since_s, alt_m = _seconds(home)[known][order], home["alt"][known][order].astype(np.float64)
    latest: NDArray[np.float64] = alt_m[np.maximum(np.searchsorted(since_s, time_s, side="right") - 1, 0)]
    return latest
