"""The lines that change while vehicles fly: where they have been, and what lies ahead of them; pure.

Each is a fixed number of segments per vehicle, so that a whole fleet's lines are one array that keeps its shape;
segments that are not needed have no length.
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
"""Points of the line that shows what a companion is about to fly."""

STEERING = {CompanionState.ENGAGING, CompanionState.FLYING, CompanionState.LANDING}


@dataclass
class TrailLine:
    """One vehicle's trail as a line: sealed chunks and a live tail.

    Args:
        spacing_m: points nearer than this to the one before are left out.
    """

    spacing_m: float
    sealed: int = 0
    live: int = 0
    """How many of `tail_m` are points of the tail."""
    tail_m: Array = field(default_factory=lambda: np.zeros((CHUNK, 3)))
    _read: int = 0

    def take(self, trail: Trail) -> list[Array]:
        """Take in a trail's new samples; (CHUNK, 2, 3) segments for each chunk that has become full."""
        if self._read == len(trail.times_s):
            return []
        chunks = []
        for point_m in trail.positions_m(self._read):
            self._read += 1
            if self.live and np.linalg.norm(point_m - self.tail_m[self.live - 1]) < self.spacing_m:
                continue
            if self.live == CHUNK:
                chunks.append(shapes.polyline(np.concatenate((self.tail_m, point_m[None]))))
                self.live = 0
            self.tail_m[self.live] = point_m
            self.live += 1
        self.sealed += len(chunks)
        return chunks


@dataclass
class AheadLine:
    """What a companion is about to fly."""

    points_m: Array = field(default_factory=lambda: np.zeros((AHEAD, 3)))
    """Along its trajectory."""
    shown: bool = False
    _revision: int | None = None

    def take(self, companion: CompanionView, *, alive: bool) -> None:
        """Take in what the companion has said last; while it does not steer, nothing is shown."""
        status, trajectory = companion.status, companion.trajectory
        self.shown = trajectory is not None and alive and status is not None and status.state in STEERING
        if self.shown and trajectory is not None and companion.trajectory_revision != self._revision:
            self._revision = companion.trajectory_revision
            self.points_m = trajectory.sample(np.linspace(trajectory.start_s, trajectory.end_s, AHEAD)).position_m


def tails(lines: list[TrailLine], positions_m: Array) -> Array:
    """(n * CHUNK, 2, 3) segments of what is not sealed yet of n trails, up to where the vehicles (n, 3) are."""
    live = np.array([line.live for line in lines])
    points_m = np.array([line.tail_m for line in lines])
    points_m = np.where((np.arange(CHUNK) < live[:, None])[..., None], points_m, positions_m[:, None])
    return _joined(points_m, positions_m[:, None])


def ways_ahead(lines: list[AheadLine], positions_m: Array) -> Array:
    """(n * AHEAD, 2, 3) segments of what lies ahead of n vehicles at (n, 3) positions, from each vehicle onwards."""
    shown = np.array([line.shown for line in lines])
    points_m = np.array([line.points_m for line in lines])
    points_m = np.where(shown[:, None, None], points_m, positions_m[:, None])
    nearest = np.argmin(np.sum((points_m - positions_m[:, None]) ** 2, axis=2), axis=1)
    following = np.minimum(nearest[:, None] + 1 + np.arange(AHEAD), AHEAD - 1)
    return _joined(positions_m[:, None], np.take_along_axis(points_m, following[..., None], axis=1))


def _joined(first_m: Array, then_m: Array) -> Array:
    """Segments (n * k, 2, 3) along n polylines of k + 1 points, each given in two parts (n, ., 3)."""
    points_m = np.concatenate((first_m, then_m), axis=1)
    return np.stack((points_m[:, :-1], points_m[:, 1:]), axis=2).reshape(-1, 2, 3)
