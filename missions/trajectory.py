"""Trajectories that vehicles fly: uniform cubic B-splines in time that end at rest."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from missions import bspline

Array = npt.NDArray[np.float64]


class Motion(NamedTuple):
    """Where a vehicle is and how it moves; each (3,) or (m, 3), in the frame of its trajectory (ENU unless said)."""

    position_m: Array
    velocity_m_s: Array
    acceleration_m_s2: Array


@dataclass(frozen=True)
class Trajectory:
    """A uniform cubic B-spline over time (eq. 21), twice continuously differentiable.

    Before `start_s` it stands in its first state. It ends at rest: its last three control points are one point, so
    that whoever stops replanning comes to a stop on a path that was checked.

    Args:
        control_points_m: (n, 3), n at least 4.
        start_s: vehicle time [s] at which the first segment begins.
        knot_interval_s: time per segment [s].

    Example:
        >>> line = Trajectory(np.array([[0, 0, 1], [0, 0, 1], [0, 0, 1], [2, 0, 1], [2, 0, 1], [2, 0, 1.0]]), 0.0, 1.0)
        >>> line.end_s, line.at(1.5).position_m.tolist(), line.at(99.0).velocity_m_s.tolist()
        (3.0, [1.0, 0.0, 1.0], [0.0, 0.0, 0.0])
    """

    control_points_m: Array
    start_s: float
    knot_interval_s: float

    def __post_init__(self) -> None:
        points = self.control_points_m
        if points.ndim != 2 or points.shape[0] < 4 or points.shape[1] != 3:
            raise ValueError(f"expected (n >= 4, 3) control points, got {points.shape}")
        if not self.knot_interval_s > 0.0:
            raise ValueError(f"expected a positive knot interval, got {self.knot_interval_s}")

    @property
    def duration_s(self) -> float:
        return (len(self.control_points_m) - 3) * self.knot_interval_s

    @property
    def end_s(self) -> float:
        return self.start_s + self.duration_s

    @property
    def end_m(self) -> Array:
        """(3,) where it comes to rest."""
        return self.control_points_m[-1]

    def at(self, time_s: float) -> Motion:
        """The motion at one vehicle time [s]; at rest after the end. What setpoints are made of: ten times faster."""
        n_segments, knot_s = len(self.control_points_m) - 3, self.knot_interval_s
        phase = (time_s - self.start_s) / knot_s
        segment = min(max(int(phase), 0), n_segments - 1)
        u = min(max(phase - segment, 0.0), 1.0)
        rate = 0.0 if phase > n_segments else 1.0 / knot_s
        powers = np.array(
            [[u**3, u**2, u, 1.0], [3 * u**2 * rate, 2 * u * rate, rate, 0.0], [6 * u * rate**2, 2 * rate**2, 0.0, 0.0]]
        )
        position_m, velocity_m_s, acceleration_m_s2 = (
            powers @ bspline.SEGMENT @ self.control_points_m[segment : segment + 4]
        )
        return Motion(position_m, velocity_m_s, acceleration_m_s2)

    def sample(self, times_s: Array) -> Motion:
        """The motion at (m,) vehicle times [s]."""
        n_segments = len(self.control_points_m) - 3
        phase = (np.asarray(times_s, dtype=float) - self.start_s) / self.knot_interval_s
        segment = np.clip(np.floor(phase).astype(int), 0, n_segments - 1)
        u = np.clip(phase - segment, 0.0, 1.0)
        around = self.control_points_m[segment[:, None] + np.arange(4)]  # (m, 4, 3)
        value, first, second = bspline.uniform_rows(u)
        ended = (phase > n_segments)[:, None]
        return Motion(
            np.einsum("mk,mkd->md", value, around),
            np.where(ended, 0.0, np.einsum("mk,mkd->md", first, around) / self.knot_interval_s),
            np.where(ended, 0.0, np.einsum("mk,mkd->md", second, around) / self.knot_interval_s**2),
        )

    def grid(self, step_s: float, from_s: float | None = None) -> Array:
        """(n,) times [s] from `from_s` (or the start) to the end, at most `step_s` apart, the end included."""
        begin = self.start_s if from_s is None else min(max(from_s, self.start_s), self.end_s)
        return np.linspace(begin, self.end_s, max(2, int(np.ceil((self.end_s - begin) / step_s)) + 1))


def at_rest(position_m: Array, start_s: float, duration_s: float = 1.0) -> Trajectory:
    """Standing still at a (3,) position."""
    return Trajectory(np.tile(np.asarray(position_m, dtype=float), (4, 1)), start_s, duration_s)
