"""What a vehicle makes of fences: its parameters and, where one is switched on, the areas it holds. No I/O.

`judge_fence` puts it into words with `mavplan.mission.fence_force`, which is heavy and imported only then.
"""

from typing import TYPE_CHECKING

from mavplan.link.download import Download, DownloadEnd
from mavplan.link.manners import Manners
from mavplan.link.outbox import Outbox
from mavplan.link.parameters import ParameterQuery
from mavplan.link.protocol import Address, Message, MissionType
from mavplan.link.transfer import Pace
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.fence_wire import fence_from_wire
from mavplan.mission.geofence import Fence
from mavplan.mission.model import HomePosition, Mission

if TYPE_CHECKING:
    from mavplan.mission.fence_force import FenceForce

QUERY_S = 6.0
"""This only adds to a report: it must not keep anybody waiting."""
SWITCHES = ("FENCE_ENABLE", "FENCE_AUTOENABLE", "GF_ACTION")
"""While all of them are 0 it does not matter what areas the vehicle holds."""


class FenceQuery(Outbox):
    """Asks one vehicle for its fence parameters and for the fence it holds.

    Parameters
    ----------
    fence
        What the vehicle is known to hold; None: fetch it where it matters.
    vehicle, us, rules, manners, pace
        As for a transfer.
    now, deadline
        Start, and when to give up; never later than `QUERY_S` from now.
    """

    def __init__(
        self,
        fence: Fence | None,
        *,
        vehicle: Address,
        us: Address,
        rules: AutopilotRules,
        manners: Manners,
        pace: Pace,
        now: float,
        deadline: float,
    ) -> None:
        from mavplan.mission.fence_force import NEEDED_PARAMETERS, OTHER_PARAMETERS

        self.fence = fence
        self.done = False
        self._deadline = min(deadline, now + QUERY_S)
        self._vehicle, self._us, self._manners, self._pace = vehicle, us, manners, pace
        self._parameters = ParameterQuery(
            vehicle,
            NEEDED_PARAMETERS[rules.name],
            OTHER_PARAMETERS[rules.name],
            bytewise=rules.name == "px4",
            pace=pace,
            now=now,
            deadline=self._deadline,
        )
        self._download: Download | None = None
        super().__init__()

    @property
    def parameters(self) -> dict[str, float]:
        """What the vehicle told, by name."""
        return self._parameters.values

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link."""
        self._parameters.receive(message, now)
        if self._download is not None:
            self._download.receive(message, now)

    def tick(self, now: float) -> None:
        """Let time pass."""
        if self.done:
            return
        self._parameters.tick(now)
        self._outbox += self._parameters.to_send()
        if not self._parameters.done:
            return
        if self._download is None:
            if self.fence is not None or not any(self.parameters.get(name) for name in SWITCHES):
                self.done = True
                return
            self._download = Download(
                self._manners,
                self._vehicle,
                self._us,
                MissionType.FENCE,
                now=now,
                deadline=self._deadline,
                pace=self._pace,
                phase="reading fence",
            )
        self._download.tick(now)
        self._outbox += self._download.to_send()
        outcome = self._download.outcome
        if outcome is not None:
            self.done = True
            if outcome.end is DownloadEnd.COMPLETE:
                self.fence = fence_from_wire(outcome.items)[0] or Fence()

    def next_timer(self) -> float | None:
        """Time of the next `tick` that matters."""
        if self.done:
            return None
        return self._parameters.next_timer() if self._download is None else self._download.next_timer()


def judge_fence(
    mission: Mission, rules: AutopilotRules, query: FenceQuery | None, home: HomePosition | None
) -> "FenceForce":
    """Return whether a fence is in force on the vehicle, and whether this mission would breach it.

    Parameters
    ----------
    mission
        What is to be flown.
    rules
        The vehicle's firmware.
    query
        What the vehicle told, as far as it did; None: it was not asked.
    home
        The vehicle's own home; None: the mission's.
    """
    from mavplan.mission.fence_force import fence_force

    if query is None:
        return fence_force(mission, rules, {}, home=home)
    return fence_force(mission, rules, query.parameters, fence=query.fence, home=home)
