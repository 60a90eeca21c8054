"""Vehicle time between two reports of it, from the event loop's clock and the speed factor."""

LONGEST_EXTRAPOLATION_S = 0.2
"""Vehicle time stands still when no report came for so long: setpoints do not run away from a stalled simulator."""

SMOOTHING = 0.1
"""Share of a report's deviation that is taken over: reports arrive with jitter."""

JUMP_S = 0.25
"""Deviations beyond this are no jitter: the clock is set anew."""

REBOOT_S = 1.0
"""An autopilot whose time lies so far back has been rebooted."""


class VehicleClock:
    """The autopilot's time since boot, estimated.

    It never runs backwards, but when the autopilot itself does (it was rebooted).

    Args:
        speed: vehicle seconds per second of the loop's clock.
    """

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._ahead_s: float | None = None
        self._reported_at_s = 0.0
        self._latest_s = 0.0

    def observe(self, vehicle_s: float, loop_s: float) -> None:
        """The autopilot's time was `vehicle_s` when `loop_s` was read."""
        ahead_s = vehicle_s - self._speed * loop_s
        if self._ahead_s is None or abs(ahead_s - self._ahead_s) > JUMP_S:
            self._ahead_s = ahead_s
        else:
            self._ahead_s += SMOOTHING * (ahead_s - self._ahead_s)
        self._reported_at_s = loop_s
        if vehicle_s < self._latest_s - REBOOT_S:
            self._latest_s = vehicle_s

    def age_s(self, loop_s: float) -> float:
        """Vehicle time since the last report; infinite before the first."""
        return float("inf") if self._ahead_s is None else self._speed * (loop_s - self._reported_at_s)

    def now_s(self, loop_s: float) -> float:
        """Vehicle time [s]; 0 before the first report."""
        if self._ahead_s is not None:
            until_s = min(loop_s, self._reported_at_s + LONGEST_EXTRAPOLATION_S / self._speed)
            self._latest_s = max(self._latest_s, self._ahead_s + self._speed * until_s)
        return self._latest_s
