"""What every command that talks to a vehicle has in common: its options, and opening the link."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import click

from mavplan.cli.kinds import Files

if TYPE_CHECKING:
    from mavplan.link.connection import Connection
    from mavplan.link.endpoint import Endpoint

_Command = TypeVar("_Command", bound=Callable[..., object])


CONN_HELP = (
    "Where the vehicle is: udp:HOST:PORT (listen), udpout:HOST:PORT, tcp:HOST:PORT, tcpin:HOST:PORT, "
    "/dev/ttyUSB0,57600; MAVSDK's udpin://… too."
)


def link_options(
    default_timeout_s: float | None = None, otherwise: str = "2 minutes and 1 s an item"
) -> Callable[[_Command], _Command]:
    """Give a decorator that adds ``--conn``, ``--system``, ``--timeout`` and ``--signing-key`` to a command.

    Parameters
    ----------
    default_timeout_s
        None: what ``otherwise`` says.
    otherwise
        The default in words, where it is no fixed number.
    """
    unless = f"; by default {otherwise}" if default_timeout_s is None else ""

    def add(command: _Command) -> _Command:
        for option in (
            click.option(
                "--signing-key",
                type=Files(),
                metavar="FILE",
                help="MAVLink 2 signing: 32 raw bytes or 64 hexadecimal digits in a file of mode 0600.",
            ),
            click.option(
                "--timeout",
                "timeout_s",
                type=click.FloatRange(min=0, min_open=True),
                default=default_timeout_s,
                show_default=default_timeout_s is not None,
                metavar="S",
                help=f"Seconds after which it is over, whatever happens{unless}.",
            ),
            click.option(
                "--system",
                type=click.IntRange(1, 255),
                metavar="N",
                help="MAVLink system of the vehicle, where several are on the line.",
            ),
            click.option("--conn", required=True, metavar="SPEC", help=CONN_HELP),
        ):
            command = option(command)
        return command

    return add


def home_options(what: str) -> Callable[[_Command], _Command]:
    """Return what adds ``--max-home-distance`` and ``--max-home-height`` to a command; ``what`` must be near."""

    def add(command: _Command) -> _Command:
        for option in (
            click.option(
                "--max-home-height",
                "max_home_height_m",
                type=click.FloatRange(min=0),
                show_default="30; 10 for a plan over terrain",
                metavar="M",
                help="Refuse a vehicle whose home is so much higher or lower than the mission's, in metres.",
            ),
            click.option(
                "--max-home-distance",
                "max_home_distance_m",
                type=click.FloatRange(min=0),
                default=500.0,
                show_default=True,
                metavar="M",
                help=f"Refuse a vehicle whose {what} is further from the mission's home, in metres.",
            ),
        ):
            command = option(command)
        return command

    return add


def via_option(command: _Command) -> _Command:
    """Add ``--via`` to a command."""
    return click.option(
        "--via",
        type=click.Choice(["own", "mavsdk"]),
        default="own",
        show_default=True,
        help="Who carries out the transfers: mavplan itself, or MAVSDK.",
    )(command)


@contextmanager
def open_link(
    endpoint: "Endpoint", timeout_s: float | None, signing_key: Path | None
) -> "Iterator[Connection]":
    """Open the link to a vehicle, signed where there is a key.

    Parameters
    ----------
    endpoint
        Where.
    timeout_s
        The command's time limit; a TCP connection may not take longer.
    signing_key
        The key's file; None: no signing.

    Raises
    ------
    InputError
        The file holds no key, or others may read it.
    NoLinkError
        The link cannot be opened.
    """
    from mavplan.link.connection import CONNECT_S, open_connection
    from mavplan.link.signing_key import open_signing

    with (
        open_signing(signing_key) as signing,
        open_connection(endpoint, min(CONNECT_S, timeout_s or CONNECT_S), signing) as connection,
    ):
        yield connection


def check_via(via: str, signing_key: Path | None) -> None:
    """Refuse what does not go together.

    Raises
    ------
    InputError
        MAVSDK is to sign, which it cannot.
    """
    from mavplan.errors import InputError

    if via == "mavsdk" and signing_key is not None:
        raise InputError(
            "--via mavsdk cannot be used with --signing-key: MAVSDK has no signing; leave one out"
        )
