"""Which targets of its route a vehicle has come to, judged by its telemetry; pure."""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from missions.mission import Target

Array = npt.NDArray[np.float64]

TELEMETRY_GAP_S = 1.0
"""Between two positions further apart in vehicle time than this, nobody knows the way that was flown [s]."""


@dataclass
class RouteWatch:
    """The targets on the way to the last one.

    Args:
        stops: all targets of the route but the last, in flying order.
        tolerance_m: a vehicle has come to a target when it was this near to it.
        stop_items: sequence number of each stop's mission item, once the mission has been made.
    """

    stops: tuple[Target, ...]
    tolerance_m: float
    stop_items: tuple[int, ...] = ()
    passed: set[str] = field(default_factory=set[str])
    """Names of the stops that the vehicle has come to."""
    _last_m: Array | None = None
    _last_s: float = 0.0

    @property
    def missed(self) -> list[str]:
        """Names of the stops that the vehicle has not come to."""
        return [stop.name for stop in self.stops if stop.name not in self.passed]

    def see(self, position_m: Array, time_s: float, mission_seq: int) -> None:
        """Take in where the vehicle is.

        Between two positions the way is taken to be straight; after a gap in the telemetry, stops that the autopilot's
        mission has left behind meanwhile count as passed.

        Args:
            position_m: (3,) ENU.
            time_s: vehicle time.
            mission_seq: the item that the mission is at.
        """
        if not self.missed or (self._last_m is not None and time_s <= self._last_s):
            return
        before_m = position_m if self._last_m is None else self._last_m
        blind = self._last_m is not None and time_s - self._last_s > TELEMETRY_GAP_S
        for index, stop in enumerate(self.stops):
            behind = blind and index < len(self.stop_items) and mission_seq > self.stop_items[index]
            if behind or segment_distance_m(np.array(stop.position_m), before_m, position_m) <= self.tolerance_m:
                self.passed.add(stop.name)
        self._last_m, self._last_s = position_m, time_s


def segment_distance_m(point_m: Array, begin_m: Array, end_m: Array) -> float:
    """Distance of a (3,) point to the straight line between two others."""
    way_m = end_m - begin_m
    length2 = float(way_m @ way_m)
    share = 0.0 if length2 == 0.0 else float(np.clip((point_m - begin_m) @ way_m / length2, 0.0, 1.0))
    return float(np.linalg.norm(point_m - begin_m - share * way_m))
