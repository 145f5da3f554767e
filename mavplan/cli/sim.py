"""``mavplan sim``: the mock vehicle, by its own command line."""

import click


@click.command(
    "sim",
    short_help="Start a mock vehicle to try things on.",
    context_settings={"ignore_unknown_options": True, "help_option_names": []},
    add_help_option=False,
)
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED)
def sim_command(arguments: tuple[str, ...]) -> int:
    """Start a mock vehicle; the same as python -m sitl_mock."""
    from sitl_mock.__main__ import main

    code: int = main(list(arguments), prog="mavplan sim")
    return code
