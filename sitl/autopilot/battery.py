"""A battery as PX4's simulator has it: drains while armed, down to a floor, and is full again when disarmed."""

from sitl.autopilot.commander import BatteryWarning
from sitl.autopilot.parameters import Parameters

FULL_V = 16.2
EMPTY_V = 14.4


class Battery:
    """State of charge of one vehicle's pack."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self.remaining = 1.0
        """Share of the charge, [0, 1]."""

    @property
    def voltage_v(self) -> float:
        return EMPTY_V + self.remaining * (FULL_V - EMPTY_V)

    @property
    def warning(self) -> BatteryWarning:
        if self.remaining <= self._parameters["BAT_EMERGEN_THR"]:
            return BatteryWarning.EMERGENCY
        if self.remaining <= self._parameters["BAT_CRIT_THR"]:
            return BatteryWarning.CRITICAL
        return BatteryWarning.LOW if self.remaining <= self._parameters["BAT_LOW_THR"] else BatteryWarning.NONE

    def update(self, armed: bool, dt_s: float) -> None:
        """Drain at 1 / SIM_BAT_DRAIN per second to SIM_BAT_MIN_PCT, or refill."""
        if not armed:
            self.remaining = 1.0
            return
        floor = min(self._parameters["SIM_BAT_MIN_PCT"] / 100.0, self.remaining)
        self.remaining = max(self.remaining - dt_s / self._parameters["SIM_BAT_DRAIN"], floor)
