"""Vehicle time between two reports of it, from the event loop's clock and the pace of the reports."""

LONGEST_EXTRAPOLATION_S = 0.2
"""Vehicle time stands still when no report came for so long: setpoints do not run away from a stalled simulator."""

SMOOTHING = 0.1
"""Share of a report's deviation that is taken over: reports arrive with jitter."""

JUMP_S = 0.25
"""Deviations beyond this are no jitter: the clock is set anew."""

REBOOT_S = 1.0
"""An autopilot whose time lies so far back has been rebooted."""

PACE_WINDOW_S = 0.5
"""Of the loop's clock: over so long it is measured how fast vehicle time passes."""

BEHIND = 0.9
"""A simulator that reaches less than this share of the speed factor cannot keep up with it; above, it is jitter."""

SLOWEST = 0.02
"""Share of the speed factor that is the least pace that is believed."""


class VehicleClock:
    """The autopilot's time since boot, estimated.

    It never runs backwards, but when the autopilot itself does (it was rebooted).

    Args:
        speed: vehicle seconds per second of the loop's clock, as ordered; a simulator may not reach it.
    """

    def __init__(self, speed: float) -> None:
        self.pace = speed
        """Vehicle seconds per second of the loop's clock, as found; never above what was ordered."""
        self._speed = speed
        self._anchor: tuple[float, float] | None = None
        """Vehicle time, smoothed, at the latest report; and the loop's clock then."""
        self._window: tuple[float, float] | None = None
        """As reported at the beginning of the window in which the pace is being measured."""
        self._latest_s = 0.0

    def observe(self, vehicle_s: float, loop_s: float) -> None:
        """The autopilot's time was `vehicle_s` when `loop_s` was read."""
        gap_s = self.age_s(loop_s) / self.pace
        if self._anchor is None or abs(ahead_s := vehicle_s - self._at(loop_s)) > JUMP_S:
            self._anchor = vehicle_s, loop_s
        else:
            self._anchor = self._at(loop_s) + SMOOTHING * ahead_s, loop_s
        self._measure_pace(vehicle_s, loop_s, gap_s)
        if vehicle_s < self._latest_s - REBOOT_S:
            self._latest_s = vehicle_s

    def _measure_pace(self, vehicle_s: float, loop_s: float, gap_s: float) -> None:
        if self._window is None or gap_s > PACE_WINDOW_S or vehicle_s < self._window[0]:
            self._window = vehicle_s, loop_s
        elif loop_s - self._window[1] >= PACE_WINDOW_S:
            share = (vehicle_s - self._window[0]) / (loop_s - self._window[1]) / self._speed
            self.pace = self._speed * (1.0 if share > BEHIND else max(share, SLOWEST))
            self._window = vehicle_s, loop_s

    def _at(self, loop_s: float) -> float:
        assert self._anchor is not None
        return self._anchor[0] + self.pace * (loop_s - self._anchor[1])

    def age_s(self, loop_s: float) -> float:
        """Vehicle time since the last report; infinite before the first."""
        return float("inf") if self._anchor is None else self.pace * (loop_s - self._anchor[1])

    def now_s(self, loop_s: float) -> float:
        """Vehicle time [s]; 0 before the first report."""
        if self._anchor is not None:
            until_s = min(loop_s, self._anchor[1] + LONGEST_EXTRAPOLATION_S / self.pace)
            self._latest_s = max(self._latest_s, self._at(until_s))
        return self._latest_s
