"""The command: ``python -m sitl_mock --firmware ardupilot|px4 --conn SPEC …``.

Exit codes: 0 ended by Ctrl-C or SIGTERM, 1 the simulated firmware crashed, 2 usage, or an address that cannot be had.
"""

import argparse
import contextlib
import json
import math
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence

from sitl_mock.autopilot import Autopilot
from sitl_mock.conn import Connection, parse_connection
from sitl_mock.endpoint import Endpoint, EndpointError, Vehicle
from sitl_mock.faults import Faults, fault_help, parse_faults
from sitl_mock.firmware import FIRMWARES
from sitl_mock.flight.air import Wind
from sitl_mock.flight.pilot import Setting
from sitl_mock.flight.power import REFERENCE_MASS_KG
from sitl_mock.network import FaultyNetwork
from sitl_mock.signing import make_signing, read_key, wall_time
from sitl_mock.vehicle import Home

DEFAULT_CONNECTION = "udpin:127.0.0.1:14550"


def _connection(text: str) -> Connection:
    try:
        return parse_connection(text)
    except ValueError as wrong:
        raise argparse.ArgumentTypeError(str(wrong)) from None


def _faults(text: str) -> str:
    try:
        parse_faults(text)
    except ValueError as wrong:
        raise argparse.ArgumentTypeError(str(wrong)) from None
    return text


def _home(text: str) -> tuple[float, float, float]:
    try:
        lat_deg, lon_deg, alt_m = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"home {text!r} must be LAT,LON,ALT, as in 47.3977,8.5456,488"
        ) from None
    try:
        Home.from_degrees(lat_deg, lon_deg, alt_m)
    except ValueError as wrong:
        raise argparse.ArgumentTypeError(str(wrong)) from None
    return lat_deg, lon_deg, alt_m


def _key(text: str) -> bytes:
    try:
        return read_key(text)
    except ValueError as wrong:
        raise argparse.ArgumentTypeError(str(wrong)) from None


def _wind(text: str) -> Wind:
    speed, at, direction = text.partition("@")
    try:
        return Wind(float(speed), float(direction) if at else 0.0)
    except ValueError as wrong:
        reason = wrong if str(wrong).startswith("wind") else "must be SPEED@FROM, as in 6@270"
        raise argparse.ArgumentTypeError(f"wind {text!r}: {reason}") from None


def _amount(low: float, high: float, what: str) -> Callable[[str], float]:
    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text!r} must be {what} from {low:g} to {high:g}")
        return value

    return read


def _number(low: int, high: int) -> Callable[[str], int]:
    def read(text: str) -> int:
        value = int(text) if text.isascii() and text.isdigit() else -1
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text!r} must be a whole number from {low} to {high}")
        return value

    return read


def _parser(prog: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=prog,
        description="A mock autopilot: the vehicle's side of MAVLink missions, with the manners of ArduPilot or PX4.",
        epilog="example: --firmware ardupilot --conn tcpin:127.0.0.1:5760 --home 47.3977,8.5456,488\n\n"
        "faults, as in --fault drop=0.3,dup,reorder,delay=200ms:\n" + fault_help(),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--firmware", choices=sorted(FIRMWARES), required=True)
    parser.add_argument(
        "--conn",
        action="append",
        type=_connection,
        metavar="SPEC",
        help=f"udpin:HOST:PORT and tcpin:HOST:PORT listen, udpout: and tcp: call; more than one may be given "
        f"(default {DEFAULT_CONNECTION})",
    )
    parser.add_argument(
        "--home", type=_home, metavar="LAT,LON,ALT", help="degrees and metres; without it: no home yet"
    )
    parser.add_argument(
        "--fault",
        action="append",
        type=_faults,
        default=[],
        metavar="NAMES",
        help="what goes wrong; see below",
    )
    parser.add_argument(
        "--seed",
        type=_number(0, 2**63),
        default=0,
        metavar="N",
        help="of faults, drift and gusts (default 0)",
    )
    parser.add_argument("--capacity", type=_number(0, 65535), metavar="N", help="mission items that fit")
    parser.add_argument(
        "--system-id", type=_number(1, 255), default=1, metavar="N", help="MAVLink system (default 1)"
    )
    parser.add_argument(
        "--signing-key",
        type=_key,
        metavar="FILE",
        help="MAVLink 2 signing: 32 bytes or 64 hexadecimal digits, mode 0600; sign all, hear only what is signed so",
    )
    parser.add_argument(
        "--speed",
        type=_amount(0.01, 1000.0, "a factor"),
        default=1.0,
        metavar="X",
        help="everything happens X times as fast (default 1)",
    )
    parser.add_argument(
        "--boot", action="store_true", help="begin with power on: booting, then not armable yet"
    )
    parser.add_argument(
        "--wind",
        type=_wind,
        default=Wind(),
        metavar="SPEED@FROM",
        help="steady wind: m/s, degrees it comes from",
    )
    parser.add_argument(
        "--battery-wh",
        type=_amount(0.1, 1e5, "watt-hours"),
        default=0.0,
        metavar="WH",
        help="energy when full; without it the battery does not run down",
    )
    parser.add_argument(
        "--mass-kg",
        type=_amount(0.05, 1000.0, "kilograms"),
        default=REFERENCE_MASS_KG,
        metavar="KG",
        help=f"of the vehicle with its load (default {REFERENCE_MASS_KG:.2f})",
    )
    parser.add_argument(
        "--pace", action="store_true", help="answer as slowly as the real autopilot was measured to"
    )
    parser.add_argument(
        "--json", action="store_true", help="say where it listens as one JSON object: firmware, system, conn"
    )
    return parser


def main(
    argv: list[str] | None = None,
    watch: Callable[[Vehicle], Vehicle] = lambda vehicle: vehicle,
    *,
    prog: str = "sitl_mock",
) -> int:
    """Run the mock until it is told to stop; return the exit code.

    Parameters
    ----------
    argv
        Arguments without the program's name; by default those of this process.
    watch
        Given the vehicle, returns what is put in its place: the same with somebody looking on.
    prog
        What it calls itself.
    """
    try:
        arguments = _parser(prog).parse_args(argv)
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else 2
    firmware = FIRMWARES[arguments.firmware]
    faults = Faults()
    for text in arguments.fault:
        faults = parse_faults(text, faults)
    autopilot = Autopilot(
        firmware,
        system_id=arguments.system_id,
        home=arguments.home,
        boot_time_s=firmware.boot_s if arguments.boot else 0.0,
        capacity=arguments.capacity,
        item_pace_s=firmware.item_pace_s if arguments.pace else 0.0,
        setting=Setting(
            seed=arguments.seed,
            wind=arguments.wind,
            battery_wh=arguments.battery_wh,
            mass_kg=arguments.mass_kg,
            faults=faults.flight,
            armable_s=firmware.armable_s if arguments.boot else 0.0,
        ),
        signing=None if arguments.signing_key is None else make_signing(arguments.signing_key, wall_time()),
        speed=arguments.speed,
    )
    vehicle: Vehicle = FaultyNetwork(autopilot, faults, arguments.seed) if faults.on_the_way else autopilot
    connections: Sequence[Connection] = arguments.conn or [parse_connection(DEFAULT_CONNECTION)]
    try:
        endpoint = Endpoint(watch(vehicle), connections, arguments.speed)
    except EndpointError as wrong:
        print(f"{prog}: {wrong}", file=sys.stderr)
        return 2
    try:
        with contextlib.closing(endpoint), _ended_by_signals():
            if arguments.json:
                told = {"firmware": arguments.firmware, "system": arguments.system_id}
                _say(json.dumps(told | {"conn": [str(bound) for bound in endpoint.bound]}))
            for bound in () if arguments.json else endpoint.bound:
                doing = "listening on" if bound.listens else "calling"
                _say(f"sitl_mock: {firmware.title}, system {arguments.system_id}, {doing} {bound}")
            endpoint.run()
    except KeyboardInterrupt:
        return 0
    print(
        f"{prog}: the simulated firmware crashed, as the real one does: {vehicle.killed_by}",
        file=sys.stderr,
    )
    return 1


def _say(line: str) -> None:
    with contextlib.suppress(BrokenPipeError):  # whoever waited for the line may be gone
        print(line, flush=True)


@contextlib.contextmanager
def _ended_by_signals() -> Iterator[None]:
    """Turn SIGTERM and SIGINT into KeyboardInterrupt, where this is the thread that may."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    names = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(name, signal.default_int_handler) for name in names]
    try:
        yield
    finally:
        for name, handler in zip(names, before, strict=True):
            signal.signal(name, handler)


if __name__ == "__main__":
    sys.exit(main())
