"""The command line. Each command is a module here, imported only when it runs, so that ``--help`` starts at once.

Errors become a message and an exit code here and nowhere else.
"""

import importlib
import io
import os
import sys
from collections.abc import Sequence

import click

from mavplan import __version__
from mavplan.errors import ExitCode, InputError, MavplanError

COMMANDS: dict[str, tuple[str, str]] = {
    "init": ("mavplan.cli.init:init_command", "Write a commented scenario to start from."),
    "plan": ("mavplan.cli.plan:plan_command", "Plan stops, order and holds, and write the mission."),
    "compare": ("mavplan.cli.compare:compare_command", "Compare all planners on one scenario."),
    "study": ("mavplan.cli.study:study_command", "Compare the planners on many random draws of users."),
    "export": ("mavplan.cli.export:export_command", "Write a mission file in another format."),
    "report": ("mavplan.cli.report:report_command", "Write a plan as one page to look at and print."),
    "check": ("mavplan.cli.check:check_command", "Check a mission or scenario against a mock vehicle."),
    "upload": ("mavplan.cli.upload:upload_command", "Upload a mission to a vehicle and read it back."),
    "download": ("mavplan.cli.download:download_command", "Save the mission that a vehicle holds."),
    "verify": ("mavplan.cli.verify:verify_command", "Tell whether a vehicle holds this mission."),
    "fly": ("mavplan.cli.fly:fly_command", "Fly a mission, watch it and record it."),
    "info": ("mavplan.cli.info:info_command", "Tell what a vehicle is and holds."),
    "clear": ("mavplan.cli.clear:clear_command", "Delete what a vehicle holds."),
    "prove": ("mavplan.cli.prove:prove_command", "Work out from a flight's log what every user received."),
    "replan": ("mavplan.cli.replan:replan_command", "Make a scenario of the users not yet served."),
    "sim": ("mavplan.cli.sim:sim_command", "Start a mock vehicle to try things on."),
    "demo": ("mavplan.cli.demo:demo_command", "From a scenario to a verified mission on a mock vehicle."),
}
"""Name → where the command is, and its line in ``mavplan --help``."""


class LazyGroup(click.Group):
    """A group that knows its commands' names and one-liners and imports a command when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names in the order in which people need them."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return one command."""
        if cmd_name not in COMMANDS:
            return None
        module, _, attribute = COMMANDS[cmd_name][0].partition(":")
        command: click.Command = getattr(importlib.import_module(module), attribute)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands without importing any."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, line) for name, (_, line) in COMMANDS.items()])


@click.group(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 done, 1 a fault of ours, 2 bad input or usage, 3 no link, 4 refused (the vehicle keeps its "
    "old mission, or was not started), 5 uncertain what the vehicle holds or how a flight ended, 6 a check found "
    "something wrong, or a flight ended otherwise than planned.",
)
@click.version_option(__version__, prog_name="mavplan")
def cli() -> None:
    """From people who need a radio link to a verified mission on a drone."""


def main(args: Sequence[str] | None = None) -> None:
    """Run the command line and exit."""
    sys.exit(run(args))


def run(args: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code; what goes wrong is said on standard error."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # An old code page without ρ or Σ shows a question mark, and does not end the command.
            stream.reconfigure(errors="replace")
    try:
        result = cli.main(args=args, prog_name="mavplan", standalone_mode=False)
    except MavplanError as error:
        _say(error)
        return int(error.exit_code)
    except click.ClickException as error:
        error.show()
        return int(ExitCode.BAD_INPUT)
    except (click.Abort, KeyboardInterrupt):
        click.echo("interrupted", err=True)
        return 130
    except BrokenPipeError:
        # Whoever read our output has gone; the interpreter must not complain about it once more at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return int(ExitCode.DONE)
    return result if isinstance(result, int) else int(ExitCode.DONE)


def _say(error: MavplanError) -> None:
    """Print an error as a person should see it."""
    from mavplan.cli.console import printable, say_problems

    if isinstance(error, InputError):
        say_problems(error.problems)
    else:
        click.secho("error: ", nl=False, err=True, fg="red")
        click.echo(printable(str(error)), err=True)
