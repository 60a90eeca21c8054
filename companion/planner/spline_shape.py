"""The constants of a local trajectory's spline: basis rows, the fit to a path, and the smooth modes of a search.

A local trajectory is a uniform cubic B-spline (eq. 21) of n control points. The first three are its start (position,
velocity, acceleration), the last three its end at rest; the n - 6 between them are free.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from missions import bspline

Array = npt.NDArray[np.float64]

SAMPLES_PER_SEGMENT = 2
SMOOTHING = 0.1
"""Weight of squared third differences against squared distances from the path in the fit."""


class SplineShape(NamedTuple):
    """Constants for n control points, f = n - 6 free ones and K samples after the first."""

    rows: Array
    """(3, s, 4) eq. 21 at the samples of one segment: for value, first and second derivative."""
    fit_path: Array
    """(f, K + 1): free control points from samples of a path ..."""
    layout: Array
    """(f, 6 + f): ... plus those from the first and last three control points, plus the smooth modes: shifts of
    the free control points, the smoothest first, of like jerk, 1 m at most."""
    into_modes: Array
    """(f, f): weights of the smooth modes from shifts of the free control points."""

    @property
    def n_control(self) -> int:
        return len(self.fit_path) + 6

    @property
    def n_samples(self) -> int:
        """K + 1."""
        return self.fit_path.shape[1]

    @property
    def modes(self) -> Array:
        """(f, f): the smooth modes of `layout` [m]."""
        return self.layout[:, 6:]


def spline_shape(n_control: int) -> SplineShape:
    """The constants for trajectories of `n_control` control points.

    Raises:
        ValueError: fewer than 7.
    """
    if n_control < 7:
        raise ValueError(f"a local trajectory needs at least 7 control points, got {n_control}")
    samples, differences = sample_rows(n_control), np.diff(np.eye(n_control), n=3, axis=0)
    free, ends = np.arange(3, n_control - 3), np.r_[0:3, n_control - 3 : n_control]
    gram = samples[:, free].T @ samples[:, free] + SMOOTHING * differences[:, free].T @ differences[:, free]
    onto_ends = samples[:, free].T @ samples[:, ends] + SMOOTHING * differences[:, free].T @ differences[:, ends]
    roughness, shapes = np.linalg.eigh(differences[:, free].T @ differences[:, free])
    modes = shapes / np.sqrt(roughness)
    modes /= np.abs(modes).max()
    return SplineShape(
        rows=np.ascontiguousarray(np.stack(bspline.uniform_rows(_phases()))),
        fit_path=np.ascontiguousarray(np.linalg.solve(gram, samples[:, free].T), dtype=float),
        layout=np.ascontiguousarray(np.hstack((-np.linalg.solve(gram, onto_ends), modes)), dtype=float),
        into_modes=np.ascontiguousarray(np.linalg.inv(modes), dtype=float),
    )


def sample_rows(n_control: int) -> Array:
    """(K + 1, n) basis values at the samples, the very end included."""
    value, _, _ = bspline.uniform_rows(_phases())
    rows = np.zeros(((n_control - 3) * SAMPLES_PER_SEGMENT + 1, n_control))
    for segment in range(n_control - 3):
        begin = segment * SAMPLES_PER_SEGMENT
        rows[begin : begin + SAMPLES_PER_SEGMENT, segment : segment + 4] = value
    rows[-1, -4:] = bspline.uniform_rows(np.array([1.0]))[0]
    return rows


def _phases() -> Array:
    return np.arange(SAMPLES_PER_SEGMENT) / SAMPLES_PER_SEGMENT
