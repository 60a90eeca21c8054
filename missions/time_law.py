"""When a path is where: speeds and times along a given curve under limits of speed and acceleration."""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

SLOWEST_M_S = 0.05
"""A path is never timed slower than this between two samples, so that times stay finite at rest."""


def speeds_along(
    points_m: Array,
    limit_m_s: Array,
    acceleration_m_s2: float,
    start_m_s: float = 0.0,
    end_m_s: float = 0.0,
) -> Array:
    """The fastest speeds along a path within its limits: one pass forwards (speeding up), one back (slowing down).

    Args:
        points_m: (n, 3) samples of the path.
        limit_m_s: (n,) the highest speed allowed at each sample.
        acceleration_m_s2: along the path, both ways.
        start_m_s: speed at the first sample.
        end_m_s: speed at the last sample.

    Returns:
        (n,) speeds [m/s].
    """
    steps_m = np.linalg.norm(np.diff(points_m, axis=0), axis=1)
    squared = np.asarray(limit_m_s, dtype=float) ** 2
    squared[0], squared[-1] = min(squared[0], start_m_s**2), min(squared[-1], end_m_s**2)
    gained = 2.0 * acceleration_m_s2 * np.concatenate(([0.0], np.cumsum(steps_m)))
    squared = gained + np.minimum.accumulate(squared - gained)  # v^2 grows by 2 a s at most
    lost = gained[-1] - gained
    squared = lost + np.minimum.accumulate((squared - lost)[::-1])[::-1]
    return np.sqrt(np.maximum(squared, 0.0))


def times_along(points_m: Array, speed_m_s: Array) -> Array:
    """(n,) times [s] from 0 at which a path's samples are passed at the given (n,) speeds."""
    steps_m = np.linalg.norm(np.diff(points_m, axis=0), axis=1)
    mean_m_s = np.maximum(0.5 * (speed_m_s[1:] + speed_m_s[:-1]), SLOWEST_M_S)
    return np.concatenate(([0.0], np.cumsum(steps_m / mean_m_s)))


def arc_length(points_m: Array) -> Array:
    """(n,) distance [m] along a polyline from its first point."""
    return np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points_m, axis=0), axis=1))))


def resample(points_m: Array, at: Array, where: Array) -> Array:
    """(m, 3) points of a polyline, given at increasing (n,) `at`, interpolated to (m,) `where`."""
    return np.stack([np.interp(where, at, points_m[:, axis]) for axis in range(points_m.shape[1])], axis=-1)
