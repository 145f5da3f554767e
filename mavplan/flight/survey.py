"""Asking a vehicle what the list before the start needs: home, fence, what it does when the link is lost. No I/O."""

from typing import TYPE_CHECKING

from mavplan.flight.preflight import Check, fence_check, link_loss_check
from mavplan.link.fence_query import FenceQuery, judge_fence
from mavplan.link.home import HomeQuery
from mavplan.link.manners import Manners
from mavplan.link.parameters import ParameterQuery
from mavplan.link.protocol import Address, Message
from mavplan.link.transfer import Pace
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.model import Autopilot, HomePosition, Mission

if TYPE_CHECKING:
    from mavplan.errors import Problem

HOME_S = 10.0
LINK_LOSS_S = 6.0
LINK_LOSS: dict[Autopilot, str] = {"ardupilot": "FS_GCS_ENABLE", "px4": "NAV_DLL_ACT"}


class Survey:
    """Asks for everything that has to be asked for, each on its own and until its time is over.

    Parameters
    ----------
    mission
        What is to be flown.
    vehicle, us, rules, manners, pace
        As for a transfer.
    now, deadline
        Start, and when to give up.
    """

    def __init__(
        self,
        mission: Mission,
        *,
        vehicle: Address,
        us: Address,
        rules: AutopilotRules,
        manners: Manners,
        pace: Pace,
        now: float,
        deadline: float,
    ) -> None:
        self._mission = mission
        self._rules = rules
        # SET_MESSAGE_INTERVAL is answered by COMMAND_ACKs as well, so that these are no answers to count.
        self._home = HomeQuery(
            vehicle, pace, now=now, deadline=min(deadline, now + HOME_S), asked_alone=False
        )
        self._fence = FenceQuery(
            mission.fence or None,
            vehicle=vehicle,
            us=us,
            rules=rules,
            manners=manners,
            pace=pace,
            now=now,
            deadline=deadline,
        )
        self._link_loss = ParameterQuery(
            vehicle,
            (),
            (LINK_LOSS[rules.name],),
            bytewise=rules.name == "px4",
            pace=pace,
            now=now,
            deadline=min(deadline, now + LINK_LOSS_S),
        )
        self._fence_check: Check | None = None

    @property
    def done(self) -> bool:
        """Whether all is known that will be."""
        return self._home.done and self._fence.done and self._link_loss.done

    @property
    def home(self) -> HomePosition | None:
        """The vehicle's home; None: not told."""
        return self._home.home

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link."""
        for part in (self._home, self._fence, self._link_loss):
            part.receive(message, now)

    def tick(self, now: float) -> None:
        """Let time pass."""
        for part in (self._home, self._fence, self._link_loss):
            part.tick(now)

    def to_send(self) -> list[Message]:
        """Return what is to be sent now."""
        return [*self._home.to_send(), *self._fence.to_send(), *self._link_loss.to_send()]

    def timers(self) -> list[float | None]:
        """Return the times of the parts' next ticks."""
        return [part.next_timer() for part in (self._home, self._fence, self._link_loss)]

    def fence(self) -> Check:
        """Judge the fence; once all is known that is not done again."""
        if self._fence_check is not None:
            return self._fence_check
        force = judge_fence(self._mission, self._rules, self._fence, self.home)
        problems: tuple[Problem, ...] = force.problems
        check = fence_check(force.words, force.enforced, force.breached, problems)
        if self.done:
            self._fence_check = check
        return check

    def link_loss(self) -> Check:
        """Judge what it does without a ground station."""
        value = self._link_loss.values.get(LINK_LOSS[self._rules.name])
        if self._rules.name == "ardupilot":
            return link_loss_check(value, None)
        return link_loss_check(None, value)
