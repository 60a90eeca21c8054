"""A battery as PX4's simulator has it: drains while armed, down to a floor, and is full again when disarmed."""

from sitl.autopilot.commander import BatteryWarning
from sitl.autopilot.memory import Charge
from sitl.autopilot.parameters import Parameters

FULL_V = 16.2
EMPTY_V = 14.4


class Battery:
    """State of charge of one vehicle's pack."""

    def __init__(self, parameters: Parameters, charge: Charge) -> None:
        self._parameters = parameters
        self._charge = charge

    @property
    def remaining(self) -> float:
        """Share of the charge, [0, 1]."""
        return self._charge.remaining

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
            self._charge.remaining = self._charge.most
            return
        floor = min(self._parameters["SIM_BAT_MIN_PCT"] / 100.0, self.remaining)
        self._charge.remaining = max(self.remaining - dt_s / self._parameters["SIM_BAT_DRAIN"], floor)
