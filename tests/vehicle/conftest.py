"""A vehicle to try everything on, named by CONN; without one these tests are skipped."""

import json
import os
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "out" / "vehicle"
CONN = os.environ.get("CONN", "")
IS_SIMULATED = os.environ.get("SIM", "") == "1"
WANTED = os.environ.get("SCENARIOS", "")
COLUMNS = ("scenario", "items", "upload s", "forecast s", "flown s", "off", "demands met", "outcome")


@dataclass
class Vehicle:
    """What answers at CONN, and the rows of the table that is printed at the end."""

    autopilot: str
    home: dict
    rows: list[dict] = field(default_factory=list)


def mavplan(*words, timeout_s=300.0):
    """Run a command as a person does; return its exit code, output and errors."""
    command = [sys.executable, "-m", "mavplan", *(str(word) for word in words)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=timeout_s, cwd=ROOT)
    return done.returncode, done.stdout, done.stderr


_VEHICLE: list[Vehicle] = []


@pytest.fixture(scope="session")
def vehicle():
    """The vehicle, asked what it is."""
    if not CONN:
        pytest.skip("no vehicle: make test-vehicle CONN=udp:0.0.0.0:14550")
    if not _VEHICLE:
        code, out, err = mavplan("info", "--conn", CONN, "--json")
        assert code == 0, err
        told = json.loads(out)
        assert told["home"] is not None, "the vehicle has no home yet: wait for its position"
        _VEHICLE.append(Vehicle(told["autopilot"], told["home"]))
    return _VEHICLE[0]


def pytest_terminal_summary(terminalreporter):
    """Print a row for each flight."""
    for found in _VEHICLE:
        terminalreporter.section(f"{found.autopilot} at {CONN}")
        rows = [COLUMNS, *(tuple(str(row.get(name, "–")) for name in COLUMNS) for row in found.rows)]
        widths = [max(len(row[column]) for row in rows) for column in range(len(COLUMNS))]
        for row in rows:
            cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
            terminalreporter.write_line("  ".join(cells).rstrip())
