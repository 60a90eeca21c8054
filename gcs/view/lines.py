"""The lines that change while vehicles fly: where they have been, and what lies ahead of them; pure.

Each is a fixed number of segments per vehicle, so that a whole fleet's lines are one array that keeps its shape;
segments that are not needed lie on the last one that is.
"""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from gcs.fleet.vehicle_state import CompanionView
from gcs.flight.trails import Trail
from gcs.view import shapes
from missions.tunnel import CompanionState

Array = npt.NDArray[np.float64]

CHUNK = 40
"""Points of a trail that stay live; when there are more, they are sealed and never sent again."""

AHEAD = 24
"""Segments of the line that shows what a companion is about to fly."""

STEERING = {CompanionState.ENGAGING, CompanionState.FLYING, CompanionState.LANDING}


def padded(segments: Array, count: int) -> Array:
    """(count, 2, 3): (n, 2, 3) segments with the last one repeated; n in 1..count."""
    return np.concatenate((segments, np.repeat(segments[-1:], count - len(segments), axis=0)))


@dataclass
class TrailLine:
    """One vehicle's trail as a line: sealed chunks and a live tail.

    Args:
        spacing_m: points nearer than this to the one before are left out.
    """

    spacing_m: float
    sealed: int = 0
    _read: int = 0
    _points_m: list[Array] = field(default_factory=list)

    def take(self, trail: Trail) -> list[Array]:
        """Take in a trail's new samples; (CHUNK, 2, 3) segments for each chunk that has become full."""
        chunks = []
        for point_m in trail.positions_m(self._read):
            self._read += 1
            if self._points_m and np.linalg.norm(point_m - self._points_m[-1]) < self.spacing_m:
                continue
            self._points_m.append(point_m)
            if len(self._points_m) > CHUNK:
                chunks.append(shapes.polyline(np.array(self._points_m)))
                self._points_m = self._points_m[-1:]
        self.sealed += len(chunks)
        return chunks

    def tail(self, position_m: Array) -> Array:
        """(CHUNK, 2, 3) segments of what is not sealed yet, up to where the vehicle is now."""
        return padded(shapes.polyline(np.array([*(self._points_m or [position_m]), position_m])), CHUNK)


@dataclass
class AheadLine:
    """What a companion is about to fly."""

    _revision: int | None = None
    _points_m: Array = field(default_factory=lambda: np.zeros((0, 3)))

    def segments(self, companion: CompanionView, position_m: Array, *, alive: bool) -> Array:
        """(AHEAD, 2, 3) its trajectory from the vehicle onwards; all at the vehicle while its companion steers not."""
        status, trajectory = companion.status, companion.trajectory
        if trajectory is None or not alive or status is None or status.state not in STEERING:
            return padded(np.array([[position_m, position_m]]), AHEAD)
        if companion.trajectory_revision != self._revision:
            self._revision = companion.trajectory_revision
            times_s = np.linspace(trajectory.start_s, trajectory.end_s, AHEAD)
            self._points_m = trajectory.sample(times_s).position_m
        nearest = int(np.argmin(np.sum((self._points_m - position_m) ** 2, axis=1)))
        rest = self._points_m[min(nearest + 1, AHEAD - 1) :]
        return padded(shapes.polyline(np.concatenate((position_m[None], rest))), AHEAD)
