"""The person at a flight: shows it, asks, and passes on what the answers are. It never waits for anybody."""

import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING

import click

from mavplan.cli.answers import END_OF_INPUT, Answers
from mavplan.cli.console import is_terminal, printable, stderr
from mavplan.cli.fly_start import RENEW_S, Start, turn_words
from mavplan.cli.fly_view import checks_table, event_line, live, start_question, step_words
from mavplan.flight.conductor import FlySession
from mavplan.flight.orders import Order
from mavplan.flight.phases import Phase
from mavplan.flight.session import STARTING
from mavplan.link.outbox import Progress
from mavplan.mission.autopilots import AUTOPILOTS

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.live import Live

    from mavplan.part import Part

SHOW_EVERY_S = 0.25
WHAT_NOW = (
    "What shall it do?  h hold where it is · r return home and land · g let it go on\n"
    "(Ctrl-C again leaves its mission alone and ends mavplan) > "
)
WHAT_NOW_HELD = (
    "It does as you ordered.  h hold · r return home and land · g leave it so, and go on watching\n"
    "(Ctrl-C again leaves it so and ends mavplan) > "
)


class FlyConsole:
    """Shows a flight on a terminal or line by line, and asks the person at it.

    Parameters
    ----------
    yes
        How many yeses were given beforehand: one to the start, two also to all that wants its own.
    start
        When it is to start, after the yes; None: at once.
    part
        Which vehicle of a fleet it is, where it is one.
    clock
        Seconds since 1970.
    quiet
        Show nothing but what is asked.
    """

    def __init__(
        self,
        yes: int,
        start: Start | None = None,
        part: "Part | None" = None,
        clock: Callable[[], float] = time.time,
        *,
        quiet: bool = False,
    ) -> None:
        self.interrupted = False
        """It was ended by the person, or by a signal."""
        self._yes = yes
        self._start = start
        self._part = part
        self._clock = clock
        self._quiet = quiet
        self._counting = False
        self._answers = Answers()
        self._terminal = is_terminal(sys.stderr)
        self._person = self._terminal and is_terminal(sys.stdin)
        self._asking: list[str] | None = None
        """Questions of the start that are not answered yet; None: not asked."""
        self._asking_what_now = False
        self._wants_to_say = False
        self._signals: list[int] = []
        self._live: Live | None = None
        self._shown_at = 0.0
        self._step = Progress("")
        self._steps_told: set[str] = set()
        self._prompt_open = ""
        """The question that stands at the end of the screen, without an answer yet."""

    # -- signals ----------------------------------------------------------------------------------------------

    @contextmanager
    def signals(self) -> Iterator[None]:
        """Take note of SIGINT and SIGTERM instead of being ended by them; what flies must be left in good order."""
        names = (signal.SIGINT, signal.SIGTERM)
        before = [signal.signal(name, self._on_signal) for name in names]
        try:
            yield
        finally:
            for name, handler in zip(names, before, strict=True):
                signal.signal(name, handler)
            self._stop_live()

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        del frame
        self._signals.append(number)

    # -- what the driver calls --------------------------------------------------------------------------------

    def see(self, session: FlySession, now: float) -> None:
        """Show what there is, and do what the person wants."""
        self._see_steps(session)
        self._see_news(session)
        if session.done:
            self._close_prompt()
            self._stop_live()
            return
        while self._signals:
            self._take_signal(self._signals.pop(0), session, now)
        if session.awaits_yes:
            self._ask_for_the_start(session, now)
        elif session.phase is Phase.FLYING and (self._asking_what_now or self._wants_to_say):
            self._ask_what_now(session, now)
        elif self._terminal and not self._quiet and now >= self._shown_at + SHOW_EVERY_S:
            self._shown_at = now
            self._show(session, now)

    def _see_steps(self, session: FlySession) -> None:
        """Take the steps of the transfers: on a terminal they move, elsewhere each kind is a line."""
        for step in session.events():
            if step.phase not in self._steps_told and not self._terminal and not self._quiet:
                click.echo(f"{step.phase} …", err=True)
            self._steps_told.add(step.phase)
            self._step = step

    def _see_news(self, session: FlySession) -> None:
        news = [] if self._quiet else session.news()
        if news and self._prompt_open:
            click.echo(err=True)
        for event in news:
            self._print(event_line(event))
        if news and self._prompt_open:
            click.echo(self._prompt_open, nl=False, err=True)

    def _take_signal(self, number: int, session: FlySession, now: float) -> None:
        flying = session.phase is Phase.FLYING
        if number == signal.SIGTERM:
            self._leave(session, now, "ended by SIGTERM")
        elif session.phase in STARTING and not self._wants_to_say:
            self._wants_to_say = self._person
            session.break_off("you interrupted the start")
        elif flying and self._person and not self._asking_what_now:
            self._wants_to_say = True
        else:
            self._leave(session, now, "interrupted")

    def _leave(self, session: FlySession, now: float, why: str) -> None:
        self.interrupted = True
        self._close_prompt()
        self._stop_live()
        session.leave(now, why)

    # -- questions --------------------------------------------------------------------------------------------

    def _ask_for_the_start(self, session: FlySession, now: float) -> None:
        if self._asking is None:
            self._stop_live()
            self._asking = self._start_questions(session, now)
            if self._asking or not self._quiet:
                stderr().print(checks_table(session.checks))
            self._prompt(self._asking)
        if not self._asking:
            if self._is_time(session, now):
                session.approve(now, every_question=True)
            return
        line = self._line()
        if line is None:
            return
        if line == END_OF_INPUT:
            session.decline("nobody answered")
        elif line.lower() not in {"y", "yes"}:
            session.decline()
        else:
            self._asking.pop(0)
            self._prompt(self._asking)

    def _is_time(self, session: FlySession, now: float) -> bool:
        """Whether it is to start now; until then the time left is shown."""
        if self._start is None:
            return True
        now_s = self._clock()
        wait_s = self._start.wait_s(now_s)
        if self._start.is_late(now_s):
            session.decline(self._start.late_words(now_s))
            return False
        if wait_s <= 0:
            self._stop_live()
            return True
        if wait_s <= RENEW_S:
            session.renew(now, RENEW_S)
        self._count_down(self._start.count_down(now_s), now)
        return False

    def _count_down(self, words: str, now: float) -> None:
        """Show how long it still waits: on a terminal it moves, elsewhere it is one line."""
        if self._quiet:
            return
        if not self._terminal:
            if not self._counting:
                click.echo(words, err=True)
        elif now >= self._shown_at + SHOW_EVERY_S:
            from rich.text import Text

            self._shown_at = now
            self._update_live(Text(words))
        self._counting = True

    def _start_questions(self, session: FlySession, now: float) -> list[str]:
        vehicle = session.vehicle
        title = "the vehicle"
        if vehicle is not None and vehicle.rules is not None:
            title = f"{AUTOPILOTS[vehicle.rules.name].title}, system {vehicle.address.system},"
        first = [] if self._yes else [start_question(title, session.picture(now))]
        rest = [] if self._yes > 1 else [f"It {check.words}. Is that meant?" for check in session.questions]
        if self._part is not None and self._start is None and self._yes <= 1:
            rest.append(f"It {turn_words(self._part)}. Is it time?")
        return first + rest

    def _prompt(self, questions: list[str]) -> None:
        if questions:
            self._answers.forget()
            self._open_prompt(f"{printable(questions[0])} [y/N] ")

    def _ask_what_now(self, session: FlySession, now: float) -> None:
        if not self._asking_what_now:
            self._asking_what_now, self._wants_to_say = True, False
            self._stop_live()
            self._answers.forget()
            self._say_what_now(session)
            return
        line = self._line()
        if line is None:
            return
        match line.lower()[:1]:
            case "h":
                session.order(Order.HOLD, now)
            case "r":
                session.order(Order.RETURN, now)
            case "g":
                self._print("it is left as it is")
            case _ if line == END_OF_INPUT:
                self._leave(session, now, "nobody is there to answer")
            case _:
                self._say_what_now(session)
                return
        self._asking_what_now = False

    def _say_what_now(self, session: FlySession) -> None:
        self._open_prompt(WHAT_NOW_HELD if session.follows_an_order else WHAT_NOW)

    def _open_prompt(self, words: str) -> None:
        self._prompt_open = words
        click.echo(words, nl=False, err=True)

    def _close_prompt(self) -> None:
        """End the line that a question without an answer stands on."""
        if self._prompt_open:
            click.echo(err=True)
        self._prompt_open = ""

    def _line(self) -> str | None:
        line = self._answers.line()
        if line == END_OF_INPUT:
            self._close_prompt()
        elif line is not None:
            self._prompt_open = ""
        return line

    # -- showing ----------------------------------------------------------------------------------------------

    def _print(self, line: str) -> None:
        if self._live is not None:
            self._live.console.print(line, soft_wrap=True)
        else:
            click.echo(line, err=True)

    def _show(self, session: FlySession, now: float) -> None:
        picture = session.picture(now)
        self._update_live(step_words(self._step) if picture is None else live(picture))

    def _update_live(self, shown: "RenderableType") -> None:
        if self._live is None:
            from rich.live import Live

            self._live = Live(console=stderr(), auto_refresh=False, transient=True)
            self._live.start()
        self._live.update(shown, refresh=True)

    def _stop_live(self) -> None:
        if self._live is not None:
            self._live.stop()
            self._live = None
