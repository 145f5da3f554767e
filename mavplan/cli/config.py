"""``mavplan config``: which settings are in force, and where they were made."""

import dataclasses

import click

from mavplan.errors import InputError, Problem


@click.command("config", short_help="Show which settings are in force, and where they were made.")
def config_command() -> None:
    """Show what the environment and the settings file say, and check all of it.

    The file is mavplan.toml in this folder, else config.toml in $XDG_CONFIG_HOME/mavplan (~/.config/mavplan), or what
    --config or MAVPLAN_CONFIG names. The command line beats the environment, and that the file.

    \b
    mavplan config
    MAVPLAN_CONN=udp:0.0.0.0:14550 mavplan config
    mavplan --config field.toml config --json
    """
    from mavplan.cli import COMMANDS, cli
    from mavplan.cli.console import answer, plain_table, print_table, printable, say_problems, tell
    from mavplan.cli.settings import COMMON, IN_META, Setting, SettingsFile, defaults_of, settings_in_force

    ctx = click.get_current_context()
    found: SettingsFile = ctx.meta[IN_META]
    commands = [command for name in COMMANDS if (command := cli.get_command(ctx, name)) is not None]
    problems: dict[str, Problem] = {}
    for command in commands:
        try:
            defaults_of(command, found)
        except InputError as error:
            problems |= {str(problem): problem for problem in error.problems}
    if problems:
        raise InputError(problems.values())
    told = list(settings_in_force(found, commands))
    settings = [one for one in told if isinstance(one, Setting)]
    say_problems(one for one in told if isinstance(one, Problem))
    tell(f"settings file: {found.path or 'none'}")
    if settings:
        table = plain_table()
        for heading in ("command", "option", "value", "from"):
            table.add_column(heading)
        for one in settings:
            whose = "every" if one.command == COMMON else one.command
            table.add_row(whose, f"--{one.option}", printable(one.value), printable(one.made_in))
        tell()
        print_table(table)
    answer(
        {
            "file": None if found.path is None else str(found.path),
            "settings": [dataclasses.asdict(one) for one in settings],
        }
    )
