"""A made-up flight, and the same flight as each kind of log: written here by the formats' descriptions, not by mavplan.

The vehicle jumps to its speed and back to rest: what counts in these tests is what is written and what is read.
"""

import struct
from dataclasses import dataclass, replace

import numpy as np
from pymavlink.dialects.v20 import common

from mavplan.geo import LocalPlane
from tests.support import HOME

EPOCH_US = 1_700_000_000_000_000
AUTOPILOTS = {"ardupilot": 3, "px4": 12}
AUTO_MODE = {"ardupilot": 3, "px4": 4 << 16 | 4 << 24}


@dataclass(frozen=True)
class Flight:
    """What a vehicle did, by its own clock; reached and current as (time, item), numbered as it does."""

    time_s: np.ndarray
    xyz_m: np.ndarray
    armed_s: tuple[float, float]
    reached: tuple[tuple[float, int], ...] = ()
    current: tuple[tuple[float, int], ...] = ()
    autopilot: str = "ardupilot"
    home: tuple[float, float, float] = (HOME.lat_deg, HOME.lon_deg, HOME.alt_amsl_m)

    @property
    def lat_lon_deg(self):
        return LocalPlane(*self.home[:2]).to_lat_lon_deg(self.xyz_m[:, :2])

    def cut(self, from_s=-np.inf, until_s=np.inf):
        """The flight's positions between two times."""
        kept = (self.time_s >= from_s) & (self.time_s <= until_s)
        return replace(self, time_s=self.time_s[kept], xyz_m=self.xyz_m[kept])

    def without(self, from_s, until_s):
        """The flight without the positions between two times."""
        kept = (self.time_s < from_s) | (self.time_s > until_s)
        return replace(self, time_s=self.time_s[kept], xyz_m=self.xyz_m[kept])


def fly(
    stops_m,
    holds_s,
    *,
    height_m=100.0,
    speed_m_s=10.0,
    hz=10.0,
    start_s=20.0,
    autopilot="ardupilot",
    items=None,
):
    """Climb, visit the stops, come back, descend; ``items``: (first, hold) of each stop, from 0 without home."""
    shift = 1 if autopilot == "ardupilot" else 0
    items = items or [(2 + 2 * n, 3 + 2 * n) for n in range(len(stops_m))]
    now, place = start_s, np.zeros(2)
    knots = [(0.0, 0.0, 0.0, 0.0), (now, 0.0, 0.0, 0.0)]
    now += height_m / 2.5
    knots.append((now, 0.0, 0.0, height_m))
    reached, current = [(now, items[0][0] - 1 + shift)], [(start_s, items[0][0] - 1 + shift)]
    for stop, hold_s, (first, hold) in zip(np.asarray(stops_m, dtype=float), holds_s, items, strict=True):
        current.append((now, first + shift))
        now += np.linalg.norm(stop - place) / speed_m_s
        knots.append((now, *stop, height_m))
        if first < hold:
            reached.append((now, first + shift))
            current.append((now, hold + shift))
        now += hold_s
        knots.append((now, *stop, height_m))
        if autopilot == "ardupilot" or hold != items[-1][1]:
            reached.append((now, hold + shift))
        place = stop
    current.append((now, items[-1][1] + 1 + shift))
    if autopilot == "px4":
        reached.append((now, items[-1][1] + 1))
    now += np.linalg.norm(place) / speed_m_s
    knots.append((now, 0.0, 0.0, height_m))
    now += height_m / 1.5
    knots += [(now, 0.0, 0.0, 0.0), (now + 5.0, 0.0, 0.0, 0.0)]
    knots = np.array(knots)
    time_s = np.round(np.arange(0.0, knots[-1, 0], 1 / hz), 6)
    xyz_m = np.column_stack([np.interp(time_s, knots[:, 0], axis) for axis in knots[:, 1:].T])
    return Flight(time_s, xyz_m, (start_s - 1.0, now + 1.0), tuple(reached), tuple(current), autopilot)


def to_tlog(flight, *, system=1, component=1, station=True, speedup=1.0, delay_s=0.05, heartbeats=True):
    """The flight as a ground station records it, its own heartbeats among the vehicle's."""
    vehicle = common.MAVLink(None, srcSystem=system, srcComponent=component)
    ground = common.MAVLink(None, srcSystem=255, srcComponent=190)
    lat_deg, lon_deg = flight.lat_lon_deg
    said = []
    for time_s, lat, lon, height in zip(flight.time_s, lat_deg, lon_deg, flight.xyz_m[:, 2], strict=True):
        message = vehicle.global_position_int_encode(
            round(time_s * 1e3), round(lat * 1e7), round(lon * 1e7), 0, round(height * 1e3), 0, 0, 0, 0
        )
        said.append((time_s, vehicle, message))
    for time_s in np.arange(0.0, flight.time_s[-1], 1.0) if heartbeats else ():
        armed = flight.armed_s[0] <= time_s < flight.armed_s[1]
        mode = AUTO_MODE[flight.autopilot] if armed else 0
        message = vehicle.heartbeat_encode(2, AUTOPILOTS[flight.autopilot], 1 | 128 * armed, mode, 4)
        said.append((time_s, vehicle, message))
        if station:
            said.append((time_s, ground, ground.heartbeat_encode(6, 8, 192, 0, 4)))
    for time_s, seq in flight.reached:
        said.append((time_s, vehicle, vehicle.mission_item_reached_encode(seq)))
    for time_s, seq in flight.current:
        said.append((time_s, vehicle, vehicle.mission_current_encode(seq)))
    said.sort(key=lambda entry: entry[0])
    return b"".join(
        struct.pack(">Q", EPOCH_US + round((time_s / speedup + delay_s) * 1e6)) + bytes(message.pack(sender))
        for time_s, sender, message in said
    )


_LETTERS = {
    "Q": "Q",
    "L": "i",
    "f": "f",
    "B": "B",
    "I": "I",
    "M": "B",
    "Z": "64s",
    "H": "H",
    "n": "4s",
    "N": "16s",
}
_BIN = {
    "FMT": (128, "BBnNZ", "Type,Length,Name,Format,Columns"),
    "POS": (129, "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt"),
    "MSG": (130, "QZ", "TimeUS,Message"),
    "MODE": (131, "QMBB", "TimeUS,Mode,ModeNum,Rsn"),
    "ARM": (132, "QBIBB", "TimeUS,ArmState,ArmChecks,Forced,Method"),
    "MISE": (133, "QHHHffffLLfB", "TimeUS,CTot,CNum,CId,Prm1,Prm2,Prm3,Prm4,Lat,Lng,Alt,Frame"),
    "IMU": (134, "QBfff", "TimeUS,I,GyrX,GyrY,GyrZ"),
}


def _packing(letters):
    return "<" + "".join(_LETTERS[letter] for letter in letters)


def bin_record(name, *values):
    """One message of an onboard log of ArduPilot."""
    kind, letters, _ = _BIN[name]
    return b"\xa3\x95" + bytes([kind]) + struct.pack(_packing(letters), *values)


def bin_formats():
    """The messages that say how messages are packed."""
    return b"".join(
        bin_record(
            "FMT",
            kind,
            3 + struct.calcsize(_packing(letters)),
            name.encode(),
            letters.encode(),
            columns.encode(),
        )
        for name, (kind, letters, columns) in _BIN.items()
    )


def to_bin(flight):
    """The flight as ArduPilot logs it on board, with messages that nobody asked for in between."""
    lat_deg, lon_deg = flight.lat_lon_deg
    said = []
    for time_s, lat, lon, height in zip(flight.time_s, lat_deg, lon_deg, flight.xyz_m[:, 2], strict=True):
        us = round(time_s * 1e6)
        said.append((us, bin_record("IMU", us, 0, 0.1, 0.2, 0.3)))
        said.append(
            (us, bin_record("POS", us, round(lat * 1e7), round(lon * 1e7), height + 500, height, height))
        )
    for armed, time_s in zip((1, 0), flight.armed_s, strict=True):
        us = round(time_s * 1e6)
        said.append((us, bin_record("ARM", us, armed, 0, 0, 0)))
        said.append((us, bin_record("MODE", us, 3 if armed else 4, 3, 1)))
    for time_s, seq in flight.reached:
        us = round(time_s * 1e6)
        said.append((us, bin_record("MSG", us, b"Reached command #%d" % seq)))
    for time_s, seq in flight.current:
        us = round(time_s * 1e6)
        said.append((us, bin_record("MISE", us, 9, seq, 16, 0, 0, 0, 0, 0, 0, 0, 3)))
    said.sort(key=lambda entry: entry[0])
    return bin_formats() + b"".join(record for _, record in said)


_ULG = {
    "vehicle_global_position": (
        ("uint64_t", "timestamp"),
        ("double", "lat"),
        ("double", "lon"),
        ("float", "alt"),
    ),
    "home_position": (("uint64_t", "timestamp"), ("float", "alt"), ("bool", "valid_alt")),
    "vehicle_status": (("uint64_t", "timestamp"), ("uint8_t", "arming_state"), ("uint8_t", "nav_state")),
    "mission_result": (("uint64_t", "timestamp"), ("int32_t", "seq_reached"), ("uint16_t", "seq_current")),
}
_ULG_PACK = {
    "uint64_t": "Q",
    "double": "d",
    "float": "f",
    "bool": "B",
    "uint8_t": "B",
    "int32_t": "i",
    "uint16_t": "H",
}


def _ulg_message(kind, body):
    return struct.pack("<HB", len(body), ord(kind)) + body


def ulg_data(topic, *values):
    """One data message of an onboard log of PX4."""
    packing = "<H" + "".join(_ULG_PACK[kind] for kind, _ in _ULG[topic])
    return _ulg_message("D", struct.pack(packing, list(_ULG).index(topic), *values))


def ulg_begin():
    """Header, formats and subscriptions."""
    begin = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1)
    for topic, fields in _ULG.items():
        text = f"{topic}:" + "".join(f"{kind} {name};" for kind, name in fields)
        begin += _ulg_message("F", text.encode())
    for number, topic in enumerate(_ULG):
        begin += _ulg_message("A", struct.pack("<BH", 0, number) + topic.encode())
    return begin


def to_ulg(flight):
    """The flight as PX4 logs it on board; its home is known from the beginning."""
    lat_deg, lon_deg = flight.lat_lon_deg
    home_m = flight.home[2]
    said = [(0, ulg_data("home_position", 1, home_m, 1))]
    for time_s, lat, lon, height in zip(flight.time_s, lat_deg, lon_deg, flight.xyz_m[:, 2], strict=True):
        us = round(time_s * 1e6)
        said.append((us, ulg_data("vehicle_global_position", us, lat, lon, home_m + height)))
    for time_s in np.arange(0.0, flight.time_s[-1], 0.5):
        us = round(time_s * 1e6)
        armed = flight.armed_s[0] <= time_s < flight.armed_s[1]
        said.append((us, ulg_data("vehicle_status", us, 2 if armed else 1, 3 if armed else 4)))
    said.append((0, ulg_data("mission_result", 1, -1, 0)))
    last = -1
    for time_s, seq in flight.reached:
        us, last = round(time_s * 1e6), seq
        said.append((us, ulg_data("mission_result", us, last, seq)))
    said.sort(key=lambda entry: entry[0])
    return ulg_begin() + b"".join(record for _, record in said)


def to_csv(flight, *, armed=True, reached=True):
    """The flight as a table, its events on the lines of the positions that follow them."""
    lat_deg, lon_deg = flight.lat_lon_deg
    events = dict.fromkeys(range(len(flight.time_s)), "")
    for time_s, seq in flight.reached if reached else ():
        events[min(int(np.searchsorted(flight.time_s, time_s - 1e-9)), len(events) - 1)] = str(seq)
    header = ["time_s", "lat_deg", "lon_deg", "alt_rel_m", *(["armed"] if armed else []), "reached"]
    lines = [",".join(header)]
    for row, (time_s, lat, lon, height) in enumerate(
        zip(flight.time_s, lat_deg, lon_deg, flight.xyz_m[:, 2], strict=True)
    ):
        is_armed = [str(int(flight.armed_s[0] <= time_s < flight.armed_s[1]))] if armed else []
        lines.append(
            ",".join([f"{time_s:.3f}", f"{lat:.9f}", f"{lon:.9f}", f"{height:.3f}", *is_armed, events[row]])
        )
    return ("\n".join(lines) + "\n").encode()
