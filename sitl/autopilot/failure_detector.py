"""PX4's failure detector, as far as it watches the attitude: a vehicle that tips over has lost a motor, or worse."""

import math

from sitl.autopilot.parameters import Parameters
from sitl.snapshot import Snapshot


class FailureDetector:
    """Whether roll or pitch have been beyond FD_FAIL_R or FD_FAIL_P for long enough; 0 degrees does not watch."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._rolled_s = self._pitched_s = 0.0
        self.attitude_failed = False

    def update(self, s: Snapshot, dt_s: float) -> None:
        p = self._parameters
        self._rolled_s = self._rolled_s + dt_s if self._exceeds(s.roll_rad, "FD_FAIL_R") else 0.0
        self._pitched_s = self._pitched_s + dt_s if self._exceeds(s.pitch_rad, "FD_FAIL_P") else 0.0
        self.attitude_failed = self._rolled_s >= p["FD_FAIL_R_TTRI"] or self._pitched_s >= p["FD_FAIL_P_TTRI"]

    def _exceeds(self, angle_rad: float, name: str) -> bool:
        limit_rad = math.radians(self._parameters[name])
        return 0.0 < limit_rad < abs(angle_rad)
