"""What every command has besides its own options: ``--json``, ``--quiet``, ``--verbose``, names in the environment."""

from collections.abc import Callable, Iterable

import click
from click.core import ParameterSource

from mavplan.cli.console import Mode

_Callback = Callable[[click.Context, click.Parameter, bool], None]

PREFIX = "MAVPLAN"
SHARED = ("conn", "system", "signing-key", "quiet", "verbose")
"""Options that a setting may give to every command that has them: ``MAVPLAN_CONN``, or ``[mavplan]`` in a file."""
IN_PERSON = frozenset({"yes", "allow-armed", "all"})
"""Options that a person says at the time, on the command line, and never a setting that was made long before."""
_STRENGTH = (ParameterSource.DEFAULT_MAP, ParameterSource.ENVIRONMENT, ParameterSource.COMMANDLINE)


def furnish(command: click.Command) -> click.Command:
    """Give a command what all of them have; once, however often it is asked for."""
    if not command.add_help_option or any(param.name == "quiet" for param in command.params):
        return command
    if not isinstance(command, click.Group):
        command.params.append(
            _flag("--json", _json, "Print one JSON object on standard output, nothing else.")
        )
    command.params.append(_flag("--quiet", _volume, "Say nothing but errors.", "-q"))
    command.params.append(_flag("--verbose", _volume, "Say what is being done, and when.", "-v"))
    for option in options_of(command):
        option.allow_from_autoenv = False
        option.envvar = list(variables_of(command, option)) or None
    return command


def options_of(command: click.Command) -> Iterable[click.Option]:
    """Yield the options that settings can give."""
    for param in command.params:
        if isinstance(param, click.Option) and param.name not in {"version", "help", "settings_file"}:
            yield param


def long_name(option: click.Option) -> str:
    """Return the name that settings use: ``--signing-key`` → ``signing-key``."""
    return next(name for name in option.opts if name.startswith("--")).removeprefix("--")


def variables_of(command: click.Command, option: click.Option) -> Iterable[str]:
    """Yield the environment variables that an option listens to, the strongest first."""
    name = long_name(option)
    if name in IN_PERSON:
        return
    if not isinstance(command, click.Group):
        yield variable(str(command.name), name)
    if name in SHARED:
        yield variable(name)


def variable(*parts: str) -> str:
    """Return ``MAVPLAN_UPLOAD_CONN``."""
    return "_".join((PREFIX, *parts)).replace("-", "_").upper()


def _flag(name: str, callback: _Callback, words: str, *short: str) -> click.Option:
    """Return a flag that changes the run's `Mode` and is no argument of the command."""
    return click.Option([*short, name], is_flag=True, expose_value=False, callback=callback, help=words)


def _json(ctx: click.Context, _param: click.Parameter, value: bool) -> None:
    if value:
        ctx.ensure_object(Mode).as_json = True


def _volume(ctx: click.Context, param: click.Parameter, value: bool) -> None:
    """Obey the last of --quiet and --verbose; the command line's beats the environment's, and that the file's."""
    source = ctx.get_parameter_source(str(param.name))
    if not value or source not in _STRENGTH:
        return
    mode, strength = ctx.ensure_object(Mode), _STRENGTH.index(source)
    if strength >= mode.volume_from:
        mode.quiet, mode.verbose = param.name == "quiet", param.name == "verbose"
        mode.volume_from = strength
