"""A mission with a fence and rally points about the harness's home, and what the mock holds of them."""

import dataclasses

from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.geofence import Fence, FenceCircle, RallyPoint
from mavplan.mission.readback import differences
from mavplan.mission.uploadable import lists_to_send
from mavplan.mission.wire import WireItem
from tests.fences import box
from tests.link.harness import HOME, make_mission

FENCE = Fence(
    (box(-500, -500, 500, 2500, home=HOME),), (FenceCircle(False, HOME.lat_e7 - 300_000, HOME.lon_e7, 50.0),)
)
RALLY = (
    RallyPoint(HOME.lat_e7 + 2_000, HOME.lon_e7, 30.0),
    RallyPoint(HOME.lat_e7, HOME.lon_e7 + 3_000, 25.0),
)


def fenced(firmware, stops=4, **changes):
    """The harness's mission with a fence it keeps to, and two rally points."""
    return dataclasses.replace(make_mission(firmware, stops), **{"fence": FENCE, "rally": RALLY, **changes})


def stored(network, kind):
    """What the vehicle would give back of a list, straight from its memory."""
    return tuple(
        WireItem(i.seq, i.frame, i.command, i.current, i.autocontinue, *i.params, i.x, i.y, i.z)
        for i in network.stored(kind)
    )


def holds_all(network, mission):
    """Whether the vehicle really holds every list of this mission."""
    rules = AUTOPILOTS[mission.autopilot]
    lists = lists_to_send(mission, rules)
    return not any(differences(items, stored(network, kind), rules, kind) for kind, items in lists.items())


def set_parameter(network, name, value):
    """Change one of the mock's parameters."""
    values = network.autopilot._parameters._values
    values[name] = dataclasses.replace(values[name], value=value)


def arm(network, armed=True):
    network.autopilot.vehicle.armed = armed
