"""The battery: energy left, and the voltage and charge that are told of it."""

from dataclasses import dataclass

CELLS = 4
FULL_V, EMPTY_V = 4.2, 3.3
NOMINAL_V = 3.7 * CELLS


@dataclass(slots=True)
class Battery:
    """A battery of so many watt-hours; with 0 it never runs down.

    Attributes
    ----------
    capacity_wh
        When full.
    used_wh
        Taken out so far.
    power_w
        Being taken out.
    """

    capacity_wh: float = 0.0
    used_wh: float = 0.0
    power_w: float = 0.0

    @property
    def left(self) -> float:
        """The share that is left, 0 to 1."""
        return 1.0 if self.capacity_wh <= 0 else max(0.0, 1 - self.used_wh / self.capacity_wh)

    @property
    def percent(self) -> int:
        """As BATTERY_STATUS says it: empty only when it is."""
        return -int(-100 * self.left // 1)

    @property
    def cell_v(self) -> float:
        """Volts of a cell."""
        return EMPTY_V + (FULL_V - EMPTY_V) * self.left

    @property
    def current_a(self) -> float:
        """Amperes being drawn."""
        return self.power_w / (self.cell_v * CELLS)

    @property
    def used_mah(self) -> float:
        """Charge taken out so far."""
        return self.used_wh / NOMINAL_V * 1000

    def draw(self, power_w: float, seconds: float) -> None:
        """Take energy out."""
        self.power_w = power_w
        if self.capacity_wh > 0:
            self.used_wh = min(self.capacity_wh, self.used_wh + power_w * seconds / 3600)
