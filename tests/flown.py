"""A mission flown by the mock in this process on a virtual clock: when each item was done, and what it took."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.model import Command, Mission
from mavplan.mission.wire import to_wire
from sitl_mock.flight.air import Wind
from sitl_mock.flight.pilot import Setting
from tests.sitl_mock.rig import Rig, command, heartbeat, item

PLENTY_WH = 1e5
LONGEST_S = 7200.0
STEP_S = 0.5


@dataclass(frozen=True)
class Flown:
    """From the start of the mission, on the vehicle's clock.

    ``told`` are pairs of an item (from 0, without home) and the second at which it and all before it were done, as
    MISSION_ITEM_REACHED tells it; the end is disarming, or for a mission that stays the end of its last hold (to half
    a second).
    """

    seconds: float
    used_wh: float
    told: tuple[tuple[int, float], ...]


def fly(
    mission: Mission,
    rules: AutopilotRules,
    mass_kg: float,
    seed: int = 0,
    wind: tuple[float, float] = (0.0, 0.0),
) -> Flown:
    """Upload, arm, start, and fly it to its end; ``wind`` is m/s and the degrees it comes from."""
    home = mission.home
    setting = Setting(seed=seed, mass_kg=mass_kg, battery_wh=PLENTY_WH, wind=Wind(*wind))
    place = (home.lat_e7 / 1e7, home.lon_e7 / 1e7, home.alt_amsl_m)
    rig: Any = Rig(rules.name, home=place, setting=setting)
    rig.send(heartbeat())
    assert rig.upload(_messages(mission, rules)).type == 0
    rig.run(0.5)
    orders = (
        [command(176, 1, 4), command(400, 1), command(300)] if rules.name == "ardupilot" else [command(300)]
    )
    for order in orders:
        assert [answer.result for answer in rig.send(order) if answer.get_type() == "COMMAND_ACK"] == [0]
    start, first = rig.now, len(rig.heard)
    vehicle, battery = rig.vehicle.vehicle, rig.vehicle.pilot.battery
    stays = mission.items[-1].command == Command.NAV_LOITER_UNLIM
    last = len(mission.items) - 1 + int(rules.home_on_wire)
    while vehicle.armed and rig.now < start + LONGEST_S:
        rig.run(STEP_S)
        if stays and vehicle.current_seq == last:
            break
    assert stays or not vehicle.armed, "it never landed"
    told = tuple(_told(rig.heard[first:], mission, rules, start))
    return Flown(rig.now - start, battery.used_wh, told)


def _messages(mission: Mission, rules: AutopilotRules) -> list[Any]:
    return [
        item(
            *(wire.seq, wire.command, wire.frame),
            **{
                "current": wire.current,
                "autocontinue": wire.autocontinue,
                "x": wire.x,
                "y": wire.y,
                "z": wire.z,
            },
            **{"p1": wire.param1, "p2": wire.param2, "p3": wire.param3, "p4": wire.param4},
        )
        for wire in to_wire(mission, rules)
    ]


def _told(
    heard: Sequence[tuple[float, Any, Any]], mission: Mission, rules: AutopilotRules, start: float
) -> list[tuple[int, float]]:
    """Which items are done, and when it was first said."""
    found: dict[int, float] = {}
    for at, _, message in heard:
        if message.get_type() != "MISSION_ITEM_REACHED":
            continue
        done = message.seq - int(rules.home_on_wire)
        if rules.name == "px4" and mission.items[done].command == Command.NAV_RETURN_TO_LAUNCH:
            done -= 1  # PX4 says it when the return begins
        found.setdefault(done, at - start)
    return sorted(found.items())
