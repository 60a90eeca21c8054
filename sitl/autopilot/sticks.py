"""A pilot's sticks, as MANUAL_CONTROL brings them: where they are, whether they still count, whether they move."""

import math

from sitl.autopilot.parameters import Parameters

FULL = 1000.0
"""A stick's deflection in MANUAL_CONTROL."""
JOYSTICK_COUNTS = (1, 2, 3)
"""COM_RC_IN_MODE: a radio alone (0) and no sticks at all (4) leave MANUAL_CONTROL out."""
HIGH_THROTTLE, RAISED_THROTTLE = -0.8, 0.2
"""Above these nobody arms: in modes whose throttle is thrust, and in those whose throttle is a climb rate."""


class Sticks:
    """The sticks of one vehicle's pilot, each in [-1, 1]; up, right and forwards are positive."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._received_s = -math.inf
        self._moved = False
        self.roll = self.pitch = self.yaw = self.throttle = 0.0

    def receive(self, x: float, y: float, z: float, r: float, now_s: float) -> None:
        """Take in a MANUAL_CONTROL: pitch, roll and yaw in [-1000, 1000], thrust in [0, 1000]; others are no sticks."""
        if not (0.0 <= z <= FULL and all(-FULL <= axis <= FULL for axis in (x, y, r))):
            return
        before = (self.pitch, self.roll, self.yaw, self.throttle)
        self.pitch, self.roll, self.yaw = x / FULL, y / FULL, r / FULL
        self.throttle = 2.0 * z / FULL - 1.0
        since_s = max(now_s - self._received_s, 1e-3)
        change = max(abs(a - b) for a, b in zip((self.pitch, self.roll, self.yaw, self.throttle), before, strict=True))
        if self.is_alive(now_s) and change / since_s > self._parameters["COM_RC_STICK_OV"] / 100.0:
            self._moved = True
        self._received_s = now_s

    def is_alive(self, now_s: float) -> bool:
        """Whether sticks have come within COM_RC_LOSS_T."""
        fresh = now_s - self._received_s < self._parameters["COM_RC_LOSS_T"]
        return fresh and int(self._parameters["COM_RC_IN_MODE"]) in JOYSTICK_COUNTS

    def take_movement(self) -> bool:
        """Whether they have moved by more than COM_RC_STICK_OV per second since this was last asked."""
        moved, self._moved = self._moved, False
        return moved


def shaped(stick: float, dead_zone: float, expo: float) -> float:
    """A stick without its dead zone around the centre, and with less effect near it (1: cubic)."""
    beyond = math.copysign(max(abs(stick) - dead_zone, 0.0) / (1.0 - dead_zone), stick)
    return (1.0 - expo) * beyond + expo * beyond**3
