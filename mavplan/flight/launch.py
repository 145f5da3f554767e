"""From the yes to a mission that is flown: rewind, switch, arm, start, each as the autopilot wants it. No I/O.

What holds whatever the link does:

- A copy of a command goes out only while the vehicle was heard to be just as it was before the first one: not armed
  (or, to start, armed by us), and in no mode that somebody else chose. So a lost answer starts nothing twice.
- After a silence longer than `GAP_S` nothing is repeated: a whole flight might have been flown in it.
- Nothing arms while a late copy of what came before, a mode or a first item, may still be on its way: it would take the
  vehicle out of its mission again.
- The heartbeat decides what has happened; an answer only says it sooner, and why not.
"""

import math

from mavplan.errors import MavplanError, RefusedError
from mavplan.flight.command import CommandCall, CommandLong, CommandResult, command_result_words
from mavplan.flight.manners import ARM, START, FlightManners, set_mode
from mavplan.flight.phases import Move, Phase
from mavplan.flight.preflight import is_arming_text
from mavplan.flight.rewind import Rewind
from mavplan.flight.telemetry import Telemetry
from mavplan.link.modes import CUSTOM_MODE, mode_name
from mavplan.link.outbox import Outbox
from mavplan.link.protocol import Address, Message
from mavplan.link.transfer import Pace
from mavplan.mission.autopilots import AutopilotRules

LOOK_S = 1.2
"""A heartbeat that comes so long (and two round trips) after a command shows what became of it."""
GAP_S = 8.0
"""After a silence of so long nothing is repeated. An armed vehicle that stays on the ground disarms after 10 s."""
REFUSED_AGAIN_S = 2.0
"""Pause after a refusal, before it is asked for again."""
SWITCH_S = 20.0
ARM_S = 90.0
"""ArduPilot needs 42 s from power-up until it lets itself be armed."""
START_S = 20.0
"""As long as it stays armed; ArduPilot disarms by itself after 10 s on the ground."""
ACCEPTED_S = 6.0
"""A vehicle that has accepted the start is armed by then, or never will be."""
QUIET_S = 1.0
"""So late a copy of a command that was doubled or overtaken on its way may still arrive."""
SETTLE_S = 4.0
"""After giving up: so long a command that is late on its way may still arrive."""


class Launch(Outbox):
    """One start of one vehicle.

    Parameters
    ----------
    rules, manners
        The firmware.
    vehicle, us
        The two addresses.
    telemetry, pace
        What is known of the vehicle and of the link; others feed them.
    arm_s
        How long it is tried to arm a vehicle that refuses.
    now
        When the yes was said.
    """

    def __init__(
        self,
        rules: AutopilotRules,
        manners: FlightManners,
        *,
        vehicle: Address,
        us: Address,
        telemetry: Telemetry,
        pace: Pace,
        arm_s: float = ARM_S,
        now: float,
    ) -> None:
        self.error: MavplanError | None = None
        self.reason = ""
        """Why it was broken off, where it was."""
        self.arming_sent = False
        """Something was sent that may arm it."""
        self.begun_at = now
        self.armed_at: float | None = None
        """When the copy went out that armed it."""
        self.words: list[str] = []
        """What has happened, for people."""
        self._rules = rules
        self._manners = manners
        self._vehicle = vehicle
        self._us = us
        self._telemetry = telemetry
        self._pace = pace
        self._arm_s = arm_s
        self._mode_before = telemetry.mode_now
        self._since = now
        self._deadline = math.inf
        self._call: CommandCall | None = None
        self._refusals: list[str] = []
        self._retry_at = -math.inf
        self._given_up_at: float | None = None
        self._heard_at = now
        self._gap = False
        self._rewinding = Rewind(manners, telemetry, pace, now)
        self._broken_off = ""
        self._armed_by_answer = False
        self._was_armed = False
        self._quiet_at = -math.inf
        super().__init__()
        self._at = now

    # -- the outside ------------------------------------------------------------------------------------------

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link."""
        if self._call is not None:
            self._call.receive(message, now)

    def break_off(self, reason: str) -> None:
        """Ask for nothing more; what was sent may still have its effect."""
        self._broken_off = self._broken_off or reason

    def next_timer(self) -> float:
        """Time of the next `tick` that matters."""
        return self._at + 0.25

    def tick(self, phase: Phase, now: float) -> Move | None:
        """Let time pass in a phase; the move that is due, if one is."""
        self._at = now
        self._watch_gap(now)
        match phase:
            case Phase.REWINDING:
                return self._rewind(now)
            case Phase.SWITCHING:
                return self._switch(now)
            case Phase.ARMING:
                return self._arm(now)
            case Phase.STARTING:
                return self._start(now)
        return None

    # -- the steps --------------------------------------------------------------------------------------------

    def _rewind(self, now: float) -> Move | None:
        """Set the mission to its first item, where it is not."""
        if stopped := self._stopped_before_arming(now):
            return stopped
        rewind = self._rewinding
        if rewind.done:
            self.words += [rewind.words] if rewind.words else []
            return self._begin(now)
        if why := rewind.failure(now):
            return self._refuse(f"{self._rules.title} {why}")
        if self._is_heard(now):
            rewind.tick(now)
            self._outbox += rewind.to_send()
            self._quiet_at = rewind.sent_at + QUIET_S
        return None

    def _begin(self, now: float) -> Move:
        if self._manners.arms_itself:
            self._next(START, now, self._arm_s)
            return Move.REWOUND_TO_START
        mode = self._manners.arming_mode
        self._next(set_mode(self._rules.name, mode if mode is not None else 0), now, SWITCH_S)
        return Move.REWOUND

    def _switch(self, now: float) -> Move | None:
        """Switch to the mode for arming."""
        if stopped := self._stopped_before_arming(now):
            return stopped
        if self._telemetry.mode_now == self._manners.arming_mode:
            self._mode_before = self._telemetry.mode_now
            self._next(ARM, now, self._arm_s)
            return Move.SWITCHED
        if now >= self._deadline:
            return self._refuse(
                f"{self._rules.title} did not switch to {self._mode(self._manners.arming_mode)}"
            )
        self._send(now, {self._mode_before}, armed=False)
        return None

    def _arm(self, now: float) -> Move | None:  # noqa: PLR0911 - one return a case
        """Ask for the motors until they turn."""
        call = self._called()
        if self._is_armed() or (call.accepted and self._given_up_at is None):
            self.armed_at = call.sent_at
            self._next(START, now, START_S)
            return Move.ARMED
        if self._given_up_at is not None:
            return self._settle(now)
        if call.sent_at is None and (stopped := self._stopped_before_arming(now)):
            return stopped
        if why := self._broken_off or self._taken_over({self._manners.arming_mode}):
            return self._give_up(why, now)
        if now >= self._deadline:
            return self._give_up(f"it did not arm within {self._arm_s:.0f} s", now)
        if self._gap:
            return self._give_up(f"it was not heard for {GAP_S:.0f} s while it was to arm", now)
        if now < self._quiet_at:
            return None
        self._send(now, {self._manners.arming_mode}, armed=False)
        return None

    def _start(self, now: float) -> Move | None:  # noqa: PLR0911 - one return a case
        """Start the mission; on PX4 this arms."""
        telemetry, manners, call = self._telemetry, self._manners, self._called()
        sent_at, heard_at = call.first_sent_at, telemetry.beat_at
        under_way = self._is_armed() and telemetry.mode_now == manners.mission_mode
        if sent_at is not None and heard_at > sent_at and under_way:
            self.armed_at = self.armed_at or call.sent_at
            return Move.STARTED
        if self._given_up_at is not None:
            return self._settle(now)
        before = {self._mode_before} if manners.arms_itself else {manners.arming_mode}
        if manners.arms_itself and sent_at is None and (stopped := self._stopped_before_arming(now)):
            return stopped
        if (
            why := self._broken_off
            or self._taken_over({*before, manners.mission_mode})
            or self._fell_back(now)
        ):
            return self._give_up(why, now)
        if now >= self._deadline:
            return self._give_up(
                f"the mission did not start within {self._deadline - self._since:.0f} s", now
            )
        if self._gap:
            return self._give_up(f"it was not heard for {GAP_S:.0f} s while its mission was to start", now)
        if manners.arms_itself and call.accepted:
            return None  # the heartbeat will show it
        if now < self._quiet_at:
            return None
        modes = {*before, manners.mission_mode} if manners.arms_itself else before
        self._send(now, modes, armed=not manners.arms_itself)
        return None

    # -- sending ----------------------------------------------------------------------------------------------

    def _next(self, what: CommandLong, now: float, patience_s: float) -> None:
        self._armed_by_answer = what is START and self._call is not None and self._call.accepted
        self._call = CommandCall(what, self._vehicle, self._us)
        self._since = now
        self._deadline = now + patience_s
        self._retry_at = -math.inf
        self._refusals = []

    def _called(self) -> CommandCall:
        if self._call is None:
            raise AssertionError("no step without its command")
        return self._call

    def _send(self, now: float, modes: "set[int | None]", *, armed: bool) -> None:
        """Send a copy to a vehicle in one of these modes, armed or not, if none is on its way or has had its effect.

        After a refusal that is a new request, a little later; else a repeat with its confirmation counted on.
        """
        call, telemetry = self._called(), self._telemetry
        if call.result is not None and call.result != CommandResult.ACCEPTED:
            self._refusals.append(command_result_words(call.result))
            self._retry_at = now + REFUSED_AGAIN_S
            call.renew()
        heard_at = telemetry.beat_at
        first = call.waiting_since is None
        seen_from = now - GAP_S if call.waiting_since is None else call.waiting_since + self._look_s
        if now < self._retry_at or heard_at < seen_from:
            return
        is_armed = telemetry.armed_now or (armed and first and self._armed_by_answer)
        if is_armed != armed or telemetry.mode_now not in modes:
            return
        arms = call.what in (ARM, START)
        self.arming_sent = self.arming_sent or arms
        self._quiet_at = self._quiet_at if arms else now + QUIET_S
        self._outbox.append(call.send(now))

    @property
    def _look_s(self) -> float:
        return max(LOOK_S, 2 * self._pace.repeat_s)

    def _is_heard(self, now: float) -> bool:
        heard_at = self._telemetry.heartbeat_at
        return heard_at is not None and now < heard_at + GAP_S

    def _watch_gap(self, now: float) -> None:
        """Note a silence that came after something was sent that arms."""
        heard_at = self._telemetry.beat_at
        silent_s = (heard_at if heard_at > self._heard_at else now) - self._heard_at
        self._gap = self._gap or (self.arming_sent and silent_s > GAP_S)
        self._heard_at = max(self._heard_at, heard_at)

    # -- what has become of it --------------------------------------------------------------------------------

    def _is_armed(self) -> bool:
        return self.arming_sent and self._telemetry.armed_now

    def _fell_back(self, now: float) -> str:
        """Return that it is armed and does not fly its mission, or is not armed (any more), or nothing."""
        call, telemetry, manners = self._called(), self._telemetry, self._manners
        if not self._is_heard(now):
            return ""
        sent_at = call.sent_at
        seen_since = sent_at is not None and telemetry.beat_at > sent_at
        late = sent_at is not None and telemetry.beat_at >= sent_at + ACCEPTED_S
        if telemetry.armed_now:
            self._was_armed = self._was_armed or seen_since
            elsewhere = f"it is armed and does not fly its mission, in {self._mode(telemetry.mode_now)}"
            return elsewhere if late and manners.arms_itself else ""
        if not manners.arms_itself:
            shown = telemetry.beat_at >= self._since + self._look_s
            return "it was disarmed before the mission was started" if shown else ""
        if self._was_armed:
            return "it was armed and is not any more"
        return "it accepted the start and is not armed" if call.accepted and late else ""

    def _taken_over(self, own_modes: "set[int | None]") -> str:
        """Return that somebody else has chosen a mode, or nothing."""
        mode = self._telemetry.mode.value
        if mode in own_modes or self._telemetry.mode_now in own_modes or mode == self._mode_before:
            return ""
        return f"somebody else switched it to {self._mode(mode)}"

    def _stopped_before_arming(self, now: float) -> Move | None:
        """Return the end of a start before anything was sent that may arm, if it has to end."""
        own_modes = {self._mode_before, self._manners.arming_mode}
        why = self._broken_off or self._taken_over(own_modes)
        if why:
            return self._refuse(why)
        if self._telemetry.armed_now:
            return self._refuse("somebody else has armed it", "nothing was sent that starts it")
        return None

    def _refuse(self, why: str, so: str = "it was not armed") -> Move:
        self.error = RefusedError(f"{why}{self._said()}: {so}")
        return Move.REFUSED

    def _give_up(self, why: str, now: float) -> Move | None:
        """Ask for nothing more; a little later it shows whether it is armed."""
        self.reason = f"{why}{self._said()}"
        self._given_up_at = now
        return self._settle(now)

    def _settle(self, now: float) -> Move | None:
        """Decide, once whatever was sent has had its time, whether it stayed on the ground."""
        given_up_at = self._given_up_at if self._given_up_at is not None else now
        if self._telemetry.armed_now and self._is_heard(now):
            return Move.BROKEN_OFF
        call = self._called()
        certain_at = max(call.sent_at or -math.inf, given_up_at) + SETTLE_S
        heard_at = self._telemetry.beat_at
        if not self.arming_sent or (heard_at >= certain_at and not self._gap and not call.accepted):
            self.error = RefusedError(f"{self.reason}: it was not started")
            return Move.REFUSED
        return Move.BROKEN_OFF if now >= certain_at + GAP_S else None

    def _said(self) -> str:
        """Return the vehicle's own reasons."""
        texts = self._telemetry.texts_since(self._since)
        reasons = [text for text in texts if is_arming_text(text)] or self._telemetry.texts_since(
            self._since, 4
        )
        if reasons:
            return f" ({'; '.join(repr(text) for text in reasons[-4:])})"
        if self._refusals:
            return f" (it answered {self._refusals[-1]})"
        return ""

    def _mode(self, mode: int | None) -> str:
        return mode_name(self._rules.name, CUSTOM_MODE, mode if mode is not None else 0)
