"""How long an upload takes, COUNT to ACK, by the vehicle's watch: ``python -m benchmarks.upload_speed``.

mavplan, MAVSDK and MAVProxy upload the same seeded mission to the same mock process over UDP, in turn. The mock holds
the stopwatch (`watched_mock`), and what it then holds must be the mission. Ends with 1 where an upload fails or we take
longer than wanted: with the autopilots' measured pace 1.2 times the faster of the other two; with 50 ms of delay each
way 1.1 times a round trip for each item and two more. What counts of several runs is the least time, as whatever else
the machine does is in the others; the median is shown beside it.
"""

import argparse
import contextlib
import queue
import random
import statistics
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from benchmarks.timing import show_table
from benchmarks.transfer_oracle import HOME, Sample, make_sample
from benchmarks.upload_clients import CLIENTS, Client, UploadFailedError, missing
from benchmarks.watched_mock import Upload
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.model import Autopilot
from sitl_mock.firmware import FIRMWARES
from tests.sitl_mock.process import mock, port_of

OURS = "mavplan"
DELAY_S = 0.05
MOST_OF_OTHERS = 1.2
MOST_OF_ROUND_TRIPS = 1.1
PATIENCE_S = 20.0


@dataclass(frozen=True, slots=True)
class Cell:
    """One vehicle and mission.

    Attributes
    ----------
    firmware, items
        Of the vehicle; on the wire, home included.
    paced
        The mock answers as slowly as the autopilot was measured to; else as fast as it can.
    delay_s
        On the way, each way.
    clients
        Who uploads.
    """

    firmware: Autopilot
    items: int
    paced: bool = True
    delay_s: float = 0.0
    clients: tuple[str, ...] = tuple(CLIENTS)

    @property
    def title(self) -> str:
        """Return it in words."""
        return f"{self.vehicle}, {self.items} items"

    @property
    def vehicle(self) -> str:
        """Return its vehicle in words."""
        how = "at its pace" if self.paced else "at once"
        away = f", {self.delay_s * 1000:g} ms away" if self.delay_s else ""
        return f"{FIRMWARES[self.firmware].title} {how}{away}"

    @property
    def least_s(self) -> float:
        """What the vehicle and the way alone take: an answer to the count and to each item."""
        pace_s = FIRMWARES[self.firmware].item_pace_s if self.paced else 0.0
        return (self.items + 1) * (pace_s + 2 * self.delay_s)

    @property
    def runs(self) -> int:
        """How many uploads of each client: more where they are short, and a busy machine matters more."""
        return 1 if self.delay_s else 15 if self.least_s < 1 else 5

    def most_s(self, others_s: Sequence[float]) -> float | None:
        """Return how long we may take beside these times of others; None where nothing is wanted."""
        if self.delay_s:
            return MOST_OF_ROUND_TRIPS * (self.items + 2) * 2 * self.delay_s
        return MOST_OF_OTHERS * min(others_s) if self.paced and others_s else None


CELLS = [
    *(
        Cell(firmware, items, paced)
        for paced in (True, False)
        for firmware in AUTOPILOTS
        for items in (50, 500)
    ),
    *(Cell(firmware, 50, delay_s=DELAY_S) for firmware in AUTOPILOTS),
    *(Cell(firmware, 500, delay_s=DELAY_S, clients=(OURS,)) for firmware in AUTOPILOTS),
]


@dataclass(frozen=True, slots=True)
class Row:
    """What was measured of a cell: the seconds of each client's uploads."""

    cell: Cell
    took_s: dict[str, list[float]]

    @property
    def ours_s(self) -> float:
        """How long we take."""
        return min(self.took_s[OURS])

    @property
    def most_s(self) -> float | None:
        """How long we may take."""
        return self.cell.most_s([min(times) for name, times in self.took_s.items() if name != OURS])

    @property
    def too_slow(self) -> bool:
        """Whether we take longer than that."""
        return self.most_s is not None and self.ours_s > self.most_s

    def texts(self) -> list[str]:
        """Return it as a row of the table."""
        clients = [_least_and_median(self.took_s.get(name, [])) for name in CLIENTS]
        limits = [f"{seconds:.3f}" if seconds else "–" for seconds in (self.most_s, self.cell.least_s)]
        return [self.cell.vehicle, str(self.cell.items), *clients, *limits]


def _least_and_median(times: Sequence[float]) -> str:
    if len(times) < 2:
        return f"{times[0]:.3f}" if times else "–"
    return f"{min(times):.3f} ({statistics.median(times):.3f})"


COLUMNS = ("vehicle", "items", *(f"{name} s" for name in CLIENTS), "wanted s", "floor s")


class Stopwatch:
    """What the mock's process tells, as it comes."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._output = process.stdout
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        for line in self._output or ():
            self._lines.put(line)

    def next(self, timeout_s: float) -> Upload:
        """Wait for the vehicle to accept a mission.

        Raises
        ------
        UploadFailedError
            It has not in time.
        """
        try:
            return Upload.from_json(self._lines.get(timeout=timeout_s))
        except queue.Empty:
            raise UploadFailedError(f"the vehicle accepted no mission within {timeout_s:.0f} s") from None


def measure(cell: Cell, seed: int = 0, runs: int | None = None) -> dict[str, list[float]]:
    """Let the clients of a cell upload in turn, and return the seconds of each one's uploads.

    Raises
    ------
    UploadFailedError
        One could not, or the vehicle holds something else afterwards: a time is then worth nothing.
    """
    sample = make_sample(cell.firmware, cell.items, random.Random(seed))
    home = f"{HOME.lat_e7 / 1e7},{HOME.lon_e7 / 1e7},{HOME.alt_amsl_m}"
    options = ["--firmware", cell.firmware, "--conn", "udpin:127.0.0.1:0", "--home", home]
    options += ["--pace"] if cell.paced else []
    options += ["--fault", f"delay={cell.delay_s * 1000:g}ms"] if cell.delay_s else []
    took_s: dict[str, list[float]] = {}
    with mock(*options, module="benchmarks.watched_mock") as (process, (line,)):
        stopwatch = Stopwatch(process)
        with joined(cell, sample, port_of(line)) as clients:
            for _ in range(cell.runs if runs is None else runs):
                for name, client in clients.items():
                    client.upload()
                    upload = stopwatch.next(PATIENCE_S + 3 * cell.least_s)
                    took_s.setdefault(name, []).append(seconds_of(upload, sample, name))
    return took_s


@contextlib.contextmanager
def joined(cell: Cell, sample: Sample, port: int) -> Iterator[dict[str, Client]]:
    """Give those clients of a cell that are on this machine, connected to the mock."""
    with contextlib.ExitStack() as stack:
        yield {
            name: stack.enter_context(contextlib.closing(CLIENTS[name](sample.mission, port)))
            for name in cell.clients
            if not missing(name)
        }


def seconds_of(upload: Upload, sample: Sample, name: str) -> float:
    """Return an upload's time, if the vehicle holds what was to be uploaded."""
    if not sample.is_held(upload.stored):
        raise UploadFailedError(f"after an upload by {name} the vehicle holds another mission")
    return upload.seconds


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.upload_speed", description=__doc__)
    parser.add_argument("--runs", type=int, help="uploads of each client (default: 1 to 15, by their length)")
    parser.add_argument("--seed", type=int, default=0, help="of the missions")
    parser.add_argument(
        "--only",
        default="",
        metavar="TEXT",
        help="only where this is in the words, as in 'PX4 at its pace, 500 items'",
    )
    arguments = parser.parse_args(argv)
    if arguments.runs is not None and arguments.runs < 1:
        parser.error("--runs must be at least 1")
    cells = [cell for cell in CELLS if arguments.only in cell.title]
    if not cells:
        parser.error(
            f"nothing has {arguments.only!r} in its words: {'; '.join(cell.title for cell in CELLS)}"
        )
    for name in CLIENTS:
        if why := missing(name):
            print(why)
    rows, faults = [], []
    for cell in cells:
        try:
            row = Row(cell, measure(cell, arguments.seed, arguments.runs))
        except UploadFailedError as error:
            faults.append(f"FAILED: {cell.title}: {error}")
            continue
        rows.append(row)
        if row.too_slow:
            faults.append(f"TOO SLOW: {cell.title}: {row.ours_s:.3f} s, wanted {row.most_s:.3f} s")
    show_table(COLUMNS, [row.texts() for row in rows])
    for fault in faults:
        print(fault)
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main())
