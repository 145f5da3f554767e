"""What both firmwares do at a mission item: hold, suffer the faults that were asked for, go on, jump back."""

from abc import abstractmethod

from sitl_mock.flight.agenda import Step
from sitl_mock.flight.air import gust
from sitl_mock.flight.faults import AtItem
from sitl_mock.flight.pilot import ITEM_S, Pilot
from sitl_mock.items import StoredItem


class ItemSteps(Pilot):
    """The steps at an item."""

    @abstractmethod
    def go_on(self, seq: int, done: int | None, at: float) -> None:
        """Go on with the item `seq`, the one before it done."""

    def hold_step(self, seq: int, seconds: float) -> Step:
        """Return the step that holds at an item for so long."""

        def hold(at: float) -> float:
            self.strike(seq, at)
            return at + self.hold_s(seq, seconds)

        return hold

    def leave_step(self, seq: int) -> Step:
        """Return the step that goes on from an item to the next."""

        def leave(at: float) -> float:
            self.go_on(seq + 1, seq, at)
            return at

        return leave

    def hold_s(self, seq: int, seconds: float) -> float:
        """Return the hold of an item as it will be flown."""
        return max(seconds / 2 if self.setting.faults.hold_cut == seq else seconds, ITEM_S)

    def strike(self, seq: int, at: float) -> None:
        """Let happen what is to happen at this item; each once a flight."""
        faults = self.setting.faults
        if self._strikes("gust", faults.gust, seq) and faults.gust is not None:
            self.body.push(gust(at, faults.gust.amount, self.chance))
        if self._strikes("battery", faults.battery_drop, seq):
            self.battery.used_wh += self.battery.capacity_wh * self.battery.left / 2
        if self._strikes("position", faults.position_lost, seq) and faults.position_lost is not None:
            self._lost_until = at + faults.position_lost.amount
        if self._strikes("crash", faults.crash, seq):
            self.crashed(at)

    def _strikes(self, name: str, fault: AtItem | int | None, seq: int) -> bool:
        where = fault.item if isinstance(fault, AtItem) else fault
        if where != seq or name in self._struck:
            return False
        self._struck.add(name)
        return True

    def jump(self, item: StoredItem) -> int | None:
        """Return where a DO_JUMP leads, None once it has been done as often as it says."""
        done = self._jumps.get(item.seq, 0)
        if 0 <= item.param2 <= done:
            return None
        self._jumps[item.seq] = done + 1
        return int(item.param1)
