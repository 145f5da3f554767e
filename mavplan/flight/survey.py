"""The list before the start: asks a vehicle what only an answer tells, and looks at everything. No I/O."""

from dataclasses import dataclass

from mavplan.errors import MavplanError, Problem
from mavplan.flight.preflight import (
    Check,
    Limits,
    arming_check,
    battery_check,
    end_check,
    fence_check,
    home_check,
    link_loss_check,
    mission_check,
    position_check,
    vehicle_check,
)
from mavplan.flight.route import Route
from mavplan.flight.telemetry import MissionCurrent, Telemetry
from mavplan.link.fence_query import FenceQuery, judge_fence
from mavplan.link.home import HomeQuery
from mavplan.link.manners import Manners
from mavplan.link.parameters import ParameterQuery
from mavplan.link.protocol import Address, Message
from mavplan.link.transfer import Pace
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.model import Autopilot, HomePosition, Mission

CHECK_S = 15.0
"""What a vehicle has not told by then it does not tell."""
LISTEN_S = 3.0
"""For messages that come once a second and that not every vehicle has."""
HOME_S = 10.0
LINK_LOSS_S = 6.0
LINK_LOSS: dict[Autopilot, str] = {"ardupilot": "FS_GCS_ENABLE", "px4": "NAV_DLL_ACT"}


@dataclass(frozen=True, slots=True)
class Held:
    """What was found out about the mission on the vehicle.

    Attributes
    ----------
    found
        How it is known that it is this one, or why it is not so.
    warnings
        What the verification warned of.
    mission_id
        PX4's id of the verified mission, where it told one.
    """

    found: str | MavplanError
    warnings: tuple[Problem, ...] = ()
    mission_id: int | None = None

    def replaced_by(self, told: MissionCurrent | None, count: int) -> bool:
        """Whether the vehicle announces another mission than this one of so many items."""
        if told is None:
            return False
        other_id = None not in (told.mission_id, self.mission_id) and told.mission_id != self.mission_id
        return other_id or told.total not in {None, count}


class Survey:
    """Asks for everything that has to be asked for, each on its own and until its time is over.

    Parameters
    ----------
    mission
        What is to be flown.
    vehicle, us, rules, manners, pace
        As for a transfer.
    now
        Start.
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
    ) -> None:
        deadline = now + CHECK_S
        self.begun_at = now
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

    def complete(self, telemetry: Telemetry, now: float) -> bool:
        """Whether everything has come that is asked or listened for, or has had its time."""
        if now >= self.begun_at + CHECK_S:
            return True
        needed = (telemetry.heartbeat_at, telemetry.position, telemetry.battery, telemetry.mission)
        if not self.done or None in needed:
            return False
        return None not in (telemetry.landed.value, telemetry.ready_to_arm) or now >= self.begun_at + LISTEN_S

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

    def look(
        self, telemetry: Telemetry, held: Held | None, route: Route, limits: Limits, now: float
    ) -> tuple[Check, ...]:
        """Look at everything and return the list.

        Parameters
        ----------
        telemetry
            What the vehicle told of itself.
        held
            What is known of the mission on it; None: nothing yet.
        route, limits
            What is to be flown, and what the user allows.
        now
            The time.
        """
        planned, home = self._mission.home, self.home
        replaced = held is not None and held.replaced_by(telemetry.mission, route.count)
        found, warnings = (held.found, held.warnings) if held is not None else (None, ())
        return (
            vehicle_check(self._rules.title, telemetry, now),
            mission_check(found, warnings, replaced),
            home_check(planned, home, limits),
            position_check(planned, home, telemetry, limits, now),
            battery_check(telemetry, limits),
            self._fence_line(),
            arming_check(telemetry),
            self._link_loss_line(),
            end_check(route),
        )

    def _fence_line(self) -> Check:
        """Judge the fence; once all is known that is not done again."""
        if self._fence_check is not None:
            return self._fence_check
        force = judge_fence(self._mission, self._rules, self._fence, self.home)
        check = fence_check(force.words, force.enforced, force.breached, force.problems)
        if self.done:
            self._fence_check = check
        return check

    def _link_loss_line(self) -> Check:
        """Judge what it does without a ground station."""
        value = self._link_loss.values.get(LINK_LOSS[self._rules.name])
        if self._rules.name == "ardupilot":
            return link_loss_check(value, None)
        return link_loss_check(None, value)
