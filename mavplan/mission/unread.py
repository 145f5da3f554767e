"""What PX4 flies but does not read back: the heading of a hold, which its checksum may still tell. Pure.

param4 of LOITER_TIME is the heading in flight and comes back as a flag, 0 or 1. A mission written down with that flag
would turn the nose north when it is sent again.
"""

import dataclasses
import itertools
from collections.abc import Sequence

from mavplan.mission.checksum import px4_id
from mavplan.mission.model import NAN, Command
from mavplan.mission.wire import WireItem, plain_frame


def with_headings(items: Sequence[WireItem], announced: int | None) -> tuple[tuple[WireItem, ...], bool]:
    """Return a mission that PX4 gave with the headings of its holds, and whether they are sure.

    Parameters
    ----------
    items
        As they were read.
    announced
        PX4's checksum of them as they were sent, where it told one.

    Returns
    -------
    items, sure
        The checksum tells headings along the track (NaN) in all holds, or the flags as they are. Where it fits
        neither, or none was told, along the track stands in and ``sure`` is false.
    """
    read = tuple(items)
    along = tuple(
        dataclasses.replace(item, param4=NAN) if item.command == Command.NAV_LOITER_TIME else item
        for item in read
    )
    if all(item.command != Command.NAV_LOITER_TIME for item in read):
        return read, True
    for candidate, plain in itertools.product((along, read), (True, False)):
        if announced is not None and px4_id(_spelled(candidate, plain)) == announced:
            return candidate, True
    return along, False


def _spelled(items: Sequence[WireItem], plain: bool) -> list[WireItem]:
    """Return items with their frames as most stations send them, or as PX4 gives them back."""
    return [dataclasses.replace(item, frame=plain_frame(item.frame)) if plain else item for item in items]
