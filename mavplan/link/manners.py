"""How each autopilot behaves during a transfer, as far as the client's side must know. Measured; see docs/link.md."""

import math
from dataclasses import dataclass

from mavplan.mission.model import Autopilot


@dataclass(frozen=True, slots=True)
class Manners:
    """The manners of one firmware.

    Attributes
    ----------
    forgets_after_s
        An upload in which the vehicle got no good item for this long has ended on its side, perhaps without a word.
    forgets_download_after_s
        A download is over on its side after this long without a request; infinite where it serves any item any time.
    atomic
        The old mission stays until the last item is in. Else the count truncates it and every item overwrites it.
    atomic_lists
        Further lists, by MAV_MISSION_TYPE, whose old content stays until the new one is whole.
    boots_without_space
        It answers "no space for 0 items" while it starts.
    judges_after_s
        Seconds after its ACK until MISSION_CURRENT shows whether it takes the mission for flyable; None: it does not
        judge.
    """

    forgets_after_s: float
    forgets_download_after_s: float
    atomic: bool
    atomic_lists: frozenset[int]
    boots_without_space: bool
    judges_after_s: float | None


MANNERS: dict[Autopilot, Manners] = {
    "ardupilot": Manners(
        forgets_after_s=8.0,
        forgets_download_after_s=math.inf,
        atomic=False,
        atomic_lists=frozenset({1}),  # the fence is looked at as a whole
        boots_without_space=True,
        judges_after_s=None,
    ),
    # 1.3 s at worst, before which MISSION_CURRENT may show the state of the old mission; the rest is for the link.
    "px4": Manners(
        forgets_after_s=5.0,
        forgets_download_after_s=5.0,
        atomic=True,
        atomic_lists=frozenset(),
        boots_without_space=False,
        judges_after_s=2.0,
    ),
}
