"""The command line. Each command is a module here, imported only when it runs, so that ``--help`` starts at once.

What all commands have in common is here and nowhere else: their list, the options ``--json``, ``--quiet`` and
``--verbose``, settings from file and environment, and how errors become a message and an exit code.
"""

import importlib
import io
import os
import sys
from collections.abc import Sequence

import click

from mavplan import __version__
from mavplan.cli.common import furnish
from mavplan.cli.console import Mode, answer_failure, colour, note, printable, say, say_problems
from mavplan.errors import ExitCode, InputError, MavplanError

SECTIONS: dict[str, dict[str, tuple[str, str]]] = {
    "Plan": {
        "init": ("mavplan.cli.init:init_command", "Write a commented scenario to start from."),
        "plan": ("mavplan.cli.plan:plan_command", "Plan stops, order and holds, and write the mission."),
        "compare": ("mavplan.cli.compare:compare_command", "Compare all planners on one scenario."),
        "study": ("mavplan.cli.study:study_command", "Compare the planners on many random draws of users."),
    },
    "Look": {
        "report": (
            "mavplan.cli.report:report_command",
            "Write a plan as one page to look at and print.",
        ),
        "export": ("mavplan.cli.export:export_command", "Write a mission file in another format."),
    },
    "Try": {
        "check": ("mavplan.cli.check:check_command", "Check a mission or scenario against a mock vehicle."),
        "sim": ("mavplan.cli.sim:sim_command", "Start a mock vehicle to try things on."),
        "demo": ("mavplan.cli.demo:demo_command", "From a scenario to a verified mission on a mock vehicle."),
    },
    "Fly": {
        "upload": ("mavplan.cli.upload:upload_command", "Upload a mission to a vehicle and read it back."),
        "fly": ("mavplan.cli.fly:fly_command", "Fly a mission, watch it and record it."),
        "info": ("mavplan.cli.info:info_command", "Tell what a vehicle is and holds."),
        "verify": ("mavplan.cli.verify:verify_command", "Tell whether a vehicle holds this mission."),
        "download": ("mavplan.cli.download:download_command", "Save the mission that a vehicle holds."),
        "clear": ("mavplan.cli.clear:clear_command", "Delete what a vehicle holds."),
    },
    "Prove": {
        "prove": (
            "mavplan.cli.prove:prove_command",
            "Work out from a flight's log what every user received.",
        ),
        "replan": ("mavplan.cli.replan:replan_command", "Make a scenario of the users not yet served."),
    },
    "Set up": {
        "config": (
            "mavplan.cli.config:config_command",
            "Show which settings are in force, and where they were made.",
        ),
        "completion": (
            "mavplan.cli.completion:completion_command",
            "Print what makes a shell complete mavplan's commands.",
        ),
    },
}
"""What people do → name → where the command is, and its line in ``mavplan --help``."""

COMMANDS = {name: entry for section in SECTIONS.values() for name, entry in section.items()}

EPILOG = """\
\b
Examples:
  mavplan init rescue                                    a scenario to start from
  mavplan plan rescue/scenario.toml -o rescue.plan       stops, holds, a mission
  mavplan check rescue.plan                              a mock vehicle flies it
  mavplan upload rescue.plan --conn udp:0.0.0.0:14550    onto the vehicle, verified

Exit codes: 0 done, 1 a fault of ours, 2 bad input or usage, 3 no link, 4 refused (the vehicle keeps its old mission,
or was not started), 5 uncertain what the vehicle holds or how a flight ended, 6 a check found something wrong, or a
flight ended otherwise than planned.

Each command's help has its options and examples: mavplan help COMMAND.
"""


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
        return furnish(getattr(importlib.import_module(module), attribute))

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that is meant; ``help X`` is ``X --help``, and of a misspelt one the nearest is named."""
        name, *rest = args
        if name == "help":
            if not rest:
                click.echo(ctx.get_help())
                ctx.exit()
            name, rest = rest[0], ["--help"]
        if name not in COMMANDS and not name.startswith("-") and not ctx.resilient_parsing:
            import difflib

            near = difflib.get_close_matches(name, [*COMMANDS, "help"], 1)
            meant = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(COMMANDS)}"
            ctx.fail(f"{name!r} is no command: {meant}")
        return super().resolve_command(ctx, [name, *rest])

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands by what people do, without importing any."""
        width = max(len(name) for name in COMMANDS)
        for title, commands in SECTIONS.items():
            with formatter.section(title):
                formatter.write_dl([(name.ljust(width), line) for name, (_, line) in commands.items()])


@click.group(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=EPILOG,
)
@click.version_option(__version__, prog_name="mavplan")
@click.option(
    "--config",
    "settings_file",
    envvar="MAVPLAN_CONFIG",
    metavar="FILE",
    help="Settings; by default mavplan.toml in this folder, else ~/.config/mavplan/config.toml.",
)
@click.pass_context
def cli(ctx: click.Context, settings_file: str | None) -> None:
    """From people who need a radio link to a verified mission on a drone."""
    from mavplan.cli.settings import IN_META, defaults_of, find_file, read_file

    found = read_file(find_file(settings_file), list(COMMANDS))
    ctx.meta[IN_META] = found
    name = ctx.invoked_subcommand or ""
    command = cli.get_command(ctx, name)
    if found.path is not None and command is not None and name != "config":
        note(f"settings of {found.path}")
        ctx.default_map = {name: defaults_of(command, found)}


furnish(cli)


def main(args: Sequence[str] | None = None) -> None:
    """Run the command line and exit."""
    sys.exit(run(args))


def run(args: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code; what goes wrong is said on standard error."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # An old code page without ρ or Σ shows a question mark, and does not end the command.
            stream.reconfigure(errors="replace")
    if "_MAVPLAN_COMPLETE" in os.environ:
        from mavplan.cli.completion import register

        register()
    words = list(sys.argv[1:] if args is None else args)
    mode = Mode()
    try:
        result = cli.main(words, prog_name="mavplan", standalone_mode=False, obj=mode, color=colour())
    except (MavplanError, click.ClickException) as error:
        return _failed(error, mode, as_json=mode.as_json or "--json" in words)
    except (click.Abort, KeyboardInterrupt):
        click.echo("interrupted", err=True)
        return 130
    except (BrokenPipeError, SystemExit):
        # Whoever read our output has gone: of that click makes an exit with 1, and nothing else here exits by itself.
        # The interpreter must not complain about it once more.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return int(ExitCode.DONE)
    note("done", mode)
    return result if isinstance(result, int) else int(ExitCode.DONE)


def _failed(error: MavplanError | click.ClickException, mode: Mode, *, as_json: bool) -> int:
    """Say what went wrong, to a person and, where nothing was answered yet, to a script; return the exit code."""
    code = error.exit_code if isinstance(error, MavplanError) else ExitCode.BAD_INPUT
    if isinstance(error, InputError):
        say_problems(error.problems)
    elif isinstance(error, MavplanError):
        say("error", str(error))
    else:
        error.show()
    if not mode.quiet:
        from mavplan.cli.remedies import remedies

        for hint in remedies(error):
            click.echo(f"hint: {printable(hint)}", err=True)
    note("done", mode)
    if as_json and not mode.answered:
        answer_failure(error, code)
    return int(code)
