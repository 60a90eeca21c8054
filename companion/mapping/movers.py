"""What moves: clusters of points that are followed from scan to scan, with velocities. It is predicted, not mapped.

A thing is taken for a mover when its centre has left the place where it was, as fast as walls never seem to; until
then it is mapped like everything else, and its traces are wiped out of the map when it turns out to move.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from companion.mapping.clusters import COUNT, HIGH, LOW, MEAN, group

Array = npt.NDArray[np.float64]

CELL_VOXELS = 3.0
"""Edge of the cells by which points are grouped, in voxels."""
LARGEST_VOXELS = 11.0
"""Larger things do not move."""
FEWEST_POINTS = 2
RAY_SPACING_RAD = 0.05
"""About the angle between a sensor's neighbouring rays: edges of things lie up to half of it beyond their points."""
DEPTH_SHARE = 0.6
"""The middle of a round thing lies behind the mean of its visible points by this share of its radius."""
GATE_VOXELS = 5.0
"""A track goes on in a cluster that lies no farther than this from where it is expected."""
FOLLOWED_S = 0.3
"""How long things are watched before they are judged ..."""
LEFT_VOXELS = 3.0
"""... and how far they have to be from where they were, at least; larger things by their radius."""
HISTORY_S = 1.0
SLOWEST_VOXELS_S = 3.0
"""What is slower than this is mapped."""
FORGOTTEN_S = 0.8
"""A thing that was not seen for so long is not expected any more."""
POSITION_GAIN, VELOCITY_GAIN = 0.6, 0.25
"""Of the alpha-beta filter, per scan."""
WHOLE_SHARE = 0.75
"""What is seen higher than this share of its distance may reach beyond what the sensor sees above and below."""
STRAIGHTNESS = 0.6
"""Share of the way that leads ahead: partial views of standing things wander to and fro."""
PURGED_FARTHER_VOXELS = 2.0


@dataclass(frozen=True)
class Mover:
    """A ball that moves.

    Args:
        time_s: when it was there, vehicle time.
        centre_m: (3,) ENU.
        velocity_m_s: (3,).
        radius_m: of a ball around it.
    """

    time_s: float
    centre_m: Array
    velocity_m_s: Array
    radius_m: float


@dataclass
class Track:
    """A thing that is followed."""

    time_s: float
    centre_m: Array
    velocity_m_s: Array
    radius_m: float
    places: list[tuple[float, Array]] = field(default_factory=list[tuple[float, Array]])
    """Where its centre was measured in the last second, and when."""
    moves: bool = False

    def expected_m(self, time_s: float) -> Array:
        """(3,) where its centre should be at a time, ENU."""
        return self.centre_m + self.velocity_m_s * (time_s - self.time_s)

    def follow(self, time_s: float, measured_m: Array, radius_m: float, *, whole: bool) -> None:
        """Take in where it is now, (3,) ENU; what is not seen as a whole says little about that."""
        step_s = max(time_s - self.time_s, 1e-3)
        expected_m = self.expected_m(time_s)
        off_m = measured_m - expected_m
        self.centre_m = expected_m + POSITION_GAIN * off_m
        self.velocity_m_s = self.velocity_m_s + VELOCITY_GAIN * off_m / step_s
        self.radius_m = max(0.95 * self.radius_m, radius_m)
        self.time_s = time_s
        if whole:
            self.places.append((time_s, measured_m))
        while self.places and self.places[0][0] < time_s - HISTORY_S:
            del self.places[0]


class MoverWatch:
    """Follows things from scan to scan.

    Args:
        voxel_m: of the map; all lengths scale with it.
    """

    def __init__(self, voxel_m: float) -> None:
        self._voxel_m = voxel_m
        self._tracks: list[Track] = []
        self._wiped: list[tuple[Array, float]] = []

    @property
    def movers(self) -> tuple[Mover, ...]:
        return tuple(Mover(t.time_s, t.centre_m, t.velocity_m_s, t.radius_m) for t in self._tracks if t.moves)

    def vacated(self) -> Iterator[tuple[Array, float]]:
        """Balls (centre ENU, radius [m]) whose traces in the map belong to things that have turned out to move."""
        wiped, self._wiped = self._wiped, []
        yield from wiped

    def observe(self, time_s: float, sensor_m: Array, points_m: Array) -> npt.NDArray[np.bool_]:
        """(n,) which of the (n, 3) unexplained points of a scan belong to movers."""
        labels = np.empty(len(points_m), np.int64)
        clusters = group(points_m, sensor_m, CELL_VOXELS * self._voxel_m, labels)
        moving = np.zeros(len(clusters) + 1, dtype=bool)  # the last one: in no cluster
        self._tracks = [track for track in self._tracks if time_s - track.time_s < FORGOTTEN_S]
        free = list(self._tracks)
        for index in self._small(clusters):
            centre_m, radius_m = shape_of(clusters[index], sensor_m)
            whole = is_whole(clusters[index], sensor_m)
            moving[index] = self._assign(time_s, centre_m, radius_m, free, whole=whole)
        return moving[labels]

    def _small(self, clusters: Array) -> list[int]:
        size_m = (clusters[:, HIGH : HIGH + 3] - clusters[:, LOW : LOW + 3]).max(axis=1, initial=0.0)
        small = (size_m < LARGEST_VOXELS * self._voxel_m) & (clusters[:, COUNT] >= FEWEST_POINTS)
        return np.flatnonzero(small).tolist()

    def _assign(self, time_s: float, centre_m: Array, radius_m: float, free: list[Track], *, whole: bool) -> bool:
        """Let the nearest track go on in a cluster, or begin one; whether it is a mover."""
        gate_m = GATE_VOXELS * self._voxel_m
        off_m = [float(np.linalg.norm(track.expected_m(time_s) - centre_m)) for track in free]
        nearest = int(np.argmin(off_m)) if off_m else -1
        if nearest < 0 or off_m[nearest] > gate_m:
            places = [(time_s, centre_m)] if whole else []
            self._tracks.append(Track(time_s, centre_m, np.zeros(3), radius_m, places))
            return False
        track = free.pop(nearest)
        track.follow(time_s, centre_m, radius_m, whole=whole)
        self._judge(track)
        return track.moves

    def _judge(self, track: Track) -> None:
        """Whether it moves, from where it was measured in the last second."""
        watched_s = track.places[-1][0] - track.places[0][0] if track.places else 0.0
        if watched_s < FOLLOWED_S:
            return
        path = np.array([place for _, place in track.places])
        ahead_m = float(np.linalg.norm(path[-1] - path[0]))
        flown_m = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
        fast = ahead_m > SLOWEST_VOXELS_S * self._voxel_m * watched_s and ahead_m > STRAIGHTNESS * flown_m
        fast = fast and ahead_m > max(track.radius_m, LEFT_VOXELS * self._voxel_m)
        if fast and not track.moves:
            track.velocity_m_s = (path[-1] - path[0]) / watched_s
            farther_m = PURGED_FARTHER_VOXELS * self._voxel_m
            self._wiped += [(place, track.radius_m + farther_m) for place in path]
        turning = track.moves and float(np.linalg.norm(track.velocity_m_s)) > SLOWEST_VOXELS_S * self._voxel_m
        track.moves = fast or turning


def is_whole(cluster: Array, sensor_m: Array) -> bool:
    """A thing is seen from bottom to top: of a tree close by, a sensor sees a piece that wanders along with itself."""
    range_m = max(float(np.linalg.norm(cluster[MEAN : MEAN + 3] - sensor_m)), 1e-6)
    return bool(cluster[HIGH + 2] - cluster[LOW + 2] < WHOLE_SHARE * range_m)


def shape_of(cluster: Array, sensor_m: Array) -> tuple[Array, float]:
    """(3,) centre and radius [m] of a round thing of which one side is seen."""
    mean_m = cluster[MEAN : MEAN + 3]
    sight_m = mean_m - sensor_m
    range_m = max(float(np.linalg.norm(sight_m)), 1e-6)
    half_m = 0.5 * (cluster[HIGH : HIGH + 3] - cluster[LOW : LOW + 3])
    radius_m = float(half_m.max()) + 0.5 * RAY_SPACING_RAD * range_m
    return mean_m + DEPTH_SHARE * radius_m * sight_m / range_m, radius_m
