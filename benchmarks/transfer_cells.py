"""The campaign's cells: which faults, how many items, how often, and what is asked of the outcome."""

import random
from dataclasses import dataclass

from benchmarks.transfer_case import Case, Work
from mavplan.mission.model import Autopilot
from sitl_mock.items import Result

ITEMS = 50
BOTH: tuple[Autopilot, ...] = ("ardupilot", "px4")
NACKS = tuple(result.name for result in Result if result is not Result.ACCEPTED)


@dataclass(frozen=True, slots=True)
class Cell:
    """A kind of transfer.

    Attributes
    ----------
    name
        In the table.
    faults
        One of these a run, as ``--fault`` takes them; ``{a|b|c}`` is one of the three. Empty: a mixture of all.
    weight
        How many of the runs it gets, beside the others' weights.
    vehicle
        What is the matter with the vehicle, see `Case`.
    deadlines_s
        One of these a run; empty: as the command has it, two minutes and a second an item.
    items
        Least and greatest number on the wire.
    least_verified
        Part of the runs that must be verified; None: that depends.
    firmwares
        Whom it concerns.
    areas
        How often a fence and rally points go with the mission.
    work
        What is done.
    """

    name: str
    faults: tuple[str, ...]
    weight: int
    vehicle: str = ""
    deadlines_s: tuple[float, ...] = ()
    items: tuple[int, int] = (ITEMS, ITEMS)
    least_verified: float | None = None
    firmwares: tuple[Autopilot, ...] = BOTH
    areas: float = 0.0
    work: Work = "upload"

    def case(self, firmware: Autopilot, seed: int, number: int) -> Case:
        """Return the case of this number; the same every time."""
        chance = random.Random(f"{seed}/{self.name}/{firmware}/{number}")
        items = chance.randint(*self.items)
        faults = _chosen(chance.choice(self.faults), chance) if self.faults else _mixture(chance)
        deadline_s = chance.choice(self.deadlines_s) if self.deadlines_s else 120.0 + items
        areas = chance.random() < self.areas
        return Case(
            firmware, faults, items, deadline_s, chance.getrandbits(48), self.vehicle, areas, self.work
        )


def _chosen(text: str, chance: random.Random) -> str:
    while "{" in text:
        before, _, rest = text.partition("{")
        inside, _, after = rest.partition("}")
        text = before + chance.choice(inside.split("|")) + after
    return text


MIXTURE: dict[str, tuple[float, str]] = {
    "drop": (0.35, "{0.05|0.1|0.3|0.5}"),
    "drop-up": (0.1, "{0.1|0.3|0.5}"),
    "drop-down": (0.1, "{0.1|0.3|0.5}"),
    "dup": (0.3, "{0.1|0.3|1}"),
    "reorder": (0.3, "{0.1|0.3|1}"),
    "delay": (0.25, "{20ms|50ms|200ms|700ms}"),
    "jitter": (0.25, "{50ms|200ms|1s}"),
    "corrupt": (0.25, "{0.01|0.1|0.3}"),
    "first-lost": (0.1, ""),
    "ack-lost": (0.2, "{1|2|65535}"),
    "early-ack": (0.1, ""),
    "reboot-at": (0.2, "{1|2|12|49|60|99|1s|5s|20s}"),
    "silent-after": (0.05, "{1|7|49|51|99|3s|30s}"),
    "second-gcs": (0.2, "{read|upload}"),
    "alter": (0.03, "{1|2|30}"),
    "nack": (0.03, "{" + "|".join(NACKS) + "}"),
    "no-heartbeat": (0.01, ""),
}
"""Of each fault how likely it is in a mixture, and its values."""


def _mixture(chance: random.Random) -> str:
    names = [name for name, (likely, _) in MIXTURE.items() if chance.random() < likely]
    return ",".join(
        f"{name}={_chosen(MIXTURE[name][1], chance)}" if MIXTURE[name][1] else name for name in names
    )


SOON_OR_LATE = (3.0, 10.0, 30.0, 100.0, 200.0)
FENCED = ("", "drop=0.3", "dup={0.3|1}", "reorder={0.3|1}", "drop=0.1,dup=0.1,reorder=0.1,corrupt=0.01")

CELLS: tuple[Cell, ...] = (
    Cell("nothing", ("",), 5, least_verified=1.0),
    Cell("5 to 200 items", ("",), 5, items=(5, 200), least_verified=1.0),
    Cell("drop=0.1", ("drop=0.1",), 20, deadlines_s=(120.0,), least_verified=0.999),
    Cell("drop=0.3", ("drop=0.3",), 100, deadlines_s=(120.0,), least_verified=0.999),
    Cell("drop=0.5", ("drop=0.5",), 60, deadlines_s=(300.0,), least_verified=0.95),
    Cell("one way", ("drop-{up|down}={0.3|0.5}",), 30, least_verified=0.99),
    Cell("dup", ("dup={0.1|0.2|0.5|1}",), 25, least_verified=1.0),
    Cell("reorder", ("reorder={0.1|0.2|0.5|1}",), 25, least_verified=1.0),
    Cell("dup+reorder", ("dup={0.2|0.5|1},reorder={0.2|0.5|1}",), 25, least_verified=1.0),
    Cell("delay", ("delay={50ms|200ms|500ms},jitter={20ms|100ms|500ms}",), 20, least_verified=0.99),
    Cell("corrupt", ("corrupt={0.01|0.1|0.3}",), 20, least_verified=0.999),
    Cell("first-lost", ("first-lost",), 5, least_verified=1.0),
    Cell("ack-lost", ("ack-lost={1|3|65535}", "ack-lost,drop=0.3"), 15, least_verified=0.999),
    Cell("early-ack", ("early-ack", "early-ack,drop=0.3"), 10, least_verified=0.999),
    Cell("reboot-at", ("reboot-at={1|2|12|49|50|51|99|0s|1s|3s|4s}", "reboot-at={12|49|5s},drop=0.3"), 25),
    Cell("silent-after", ("silent-after={0|1|7|49|50|51|99|2s|3s}", "silent-after={7|50},drop=0.3"), 15),
    Cell("second-gcs=read", ("second-gcs", "second-gcs,{drop=0.3|dup=0.3|reorder}"), 15),
    Cell("second-gcs=upload", ("second-gcs=upload", "second-gcs=upload,{drop=0.3|drop=0.5|dup}"), 20),
    Cell("nack", ("nack={" + "|".join(NACKS) + "}{|,drop=0.3|,drop=0.5}",), 15, deadlines_s=(60.0,)),
    Cell("alter", ("alter={1|2|30}{|,drop=0.3}",), 5),
    Cell("no-heartbeat", ("no-heartbeat",), 2),
    Cell("capacity", ("", "drop={0.1|0.3|0.5}", "dup,reorder"), 15, vehicle="small", items=(5, 200)),
    Cell("infeasible", ("", "drop=0.3", "dup,reorder", "ack-lost"), 15, vehicle="high", firmwares=("px4",)),
    Cell("booting", ("", "drop={0.3|0.5}", "dup,reorder"), 10, vehicle="booting"),
    Cell("armed", ("", "drop=0.3"), 2, vehicle="armed"),
    Cell("drop=0.3, 5 to 200", ("drop=0.3",), 15, items=(5, 200), least_verified=0.99),
    Cell("a bad day", ("drop=0.3,dup=0.1,reorder=0.1,delay=50ms,corrupt=0.01",), 20),
    Cell("fence, rally points", FENCED, 30, areas=1.0, least_verified=0.999),
    Cell("mixture", (), 80, items=(5, 120), deadlines_s=SOON_OR_LATE, areas=0.2),
    Cell("verify", (), 30, items=(5, 80), deadlines_s=SOON_OR_LATE, areas=0.3, work="verify"),
    Cell("download", (), 30, items=(5, 80), deadlines_s=SOON_OR_LATE, areas=0.5, work="download"),
    Cell("clear", (), 30, items=(5, 80), deadlines_s=SOON_OR_LATE, areas=0.3, work="clear"),
)
