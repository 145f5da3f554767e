"""ArduPilot's three lists: what COUNT, an item, the last item and CLEAR_ALL do to each.

Mission and rally points are written item by item; a fence is stored only when it is whole and good.
"""

from sitl_mock import ardupilot_items as rules
from sitl_mock.items import RefusedItemError, Result, StoredItem
from sitl_mock.missions import SEVERITY_DEBUG, SEVERITY_INFO, SEVERITY_WARNING, Text
from sitl_mock.vehicle import VehicleState


class RallyList:
    """The rally points, written one by one; and what the other lists have in common with them."""

    timeout_text = "Rally upload timeout"

    def __init__(self) -> None:
        self._items: list[StoredItem] = []

    def count(self) -> int:
        """Return how many items read back."""
        return len(self._items)

    def begin(self, count: int) -> None:
        """Make ready for an upload: what is beyond its count is lost at once."""
        del self._items[count:]

    def put(self, item: StoredItem, last_seq: int) -> None:
        """Write the next item of an upload that ends with `last_seq`; RefusedItemError where it is not taken."""
        self._write(item.seq, rules.keep_rally_item(item))

    def finish(self) -> tuple[Result, list[Text]]:
        """Return the result of a whole upload and the texts that go with it."""
        return Result.ACCEPTED, []

    def clear(self) -> bool:
        """Empty the list; False where that may not be now."""
        self._items = []
        return True

    def read(self, seq: int) -> StoredItem | None:
        """Return an item as it reads back, None where there is none."""
        return self._items[seq] if seq < self.count() else None

    def _write(self, seq: int, kept: StoredItem) -> None:
        if seq < self.count():
            self._items[seq] = kept
        else:
            self._items.append(kept)


class MissionList(RallyList):
    """The mission. Item 0 is the vehicle's home, whatever is written there."""

    timeout_text = "Mission upload timeout"

    def __init__(self, vehicle: VehicleState) -> None:
        super().__init__()
        self._vehicle = vehicle

    def put(self, item: StoredItem, last_seq: int) -> None:
        """Write the next item; a jump must lead to an item that there is or will be."""
        kept = rules.keep_mission_item(item)
        if item.command == rules.DO_JUMP:
            target = kept.param1
            if target == 0 or (target >= self.count() and target > last_seq):
                raise RefusedItemError(Result.ERROR)
        if not self._items:
            # The first item ever written makes room for home and goes behind it; item 1 then replaces it.
            self._items = [kept, kept.numbered(1, current=0)]
        else:
            self._write(item.seq, kept)

    def finish(self) -> tuple[Result, list[Text]]:
        """Say that the flight plan was received, be it an empty one."""
        return Result.ACCEPTED, [Text(SEVERITY_INFO, "Flight plan received")]

    def clear(self) -> bool:
        """Empty the mission, unless it is being flown."""
        return not self._vehicle.mission_running and super().clear()

    def read(self, seq: int) -> StoredItem | None:
        """Return an item; home can be read from an empty mission too, and is zeros before there is one."""
        if seq > 0:
            return super().read(seq)
        home = self._vehicle.home
        lat_e7, lon_e7, alt_cm = (0, 0, 0) if home is None else (home.lat_e7, home.lon_e7, home.alt_cm)
        return StoredItem(0, 0, 16, 0, 1, 0.0, 0.0, 0.0, 0.0, lat_e7, lon_e7, rules.metres_from_cm(alt_cm))


class FenceList(RallyList):
    """The fence: taken into memory, looked at when it is whole, and only then stored."""

    timeout_text = "Fence upload timeout"

    def __init__(self) -> None:
        super().__init__()
        self._new: list[StoredItem] = []

    def begin(self, count: int) -> None:
        """Make ready for an upload."""
        self._new = []

    def put(self, item: StoredItem, last_seq: int) -> None:
        """Take the next item."""
        self._new.append(rules.keep_fence_item(item))

    def finish(self) -> tuple[Result, list[Text]]:
        """Store the new fence if it is good."""
        fault = rules.fence_fault(self._new)
        if fault is not None:
            return Result.ERROR, [
                Text(SEVERITY_WARNING, fault),
                Text(SEVERITY_WARNING, "Fence validation failed"),
            ]
        if rules.fence_bytes(self._new) > rules.FENCE_STORAGE_BYTES:
            return Result.ERROR, [Text(SEVERITY_WARNING, "Fence exceeds storage size")]
        self._items = self._new
        return Result.ACCEPTED, [Text(SEVERITY_DEBUG, "Fence Indexed OK")] if self._items else []
