"""Dense curves: samples equally spaced along every vehicle's curve, as many for all; and what is measured on them."""

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline

from missions import bspline, time_law

Array = npt.NDArray[np.float64]

TABLE = 1024
"""Samples from which the parameter is found at which a curve has a given length; more for wild curves."""
SPARE = 0.99
"""Samples lie at most this share of the allowed spacing apart."""


def dense_curves(controls_m: Array, spacing_m: float) -> Array:
    """(vehicles, m, 3) samples of all curves at equal steps along each, at most `spacing_m` apart on the longest.

    Args:
        controls_m: (vehicles, n, 3) control points, ENU [m].
        spacing_m: between samples.
    """
    table = TABLE
    curves_m = _sampled(controls_m, spacing_m, table)
    while lengths(np.diff(curves_m, axis=1)).max() > spacing_m:  # the table is too coarse for curves this wild
        table *= 2
        curves_m = _sampled(controls_m, spacing_m, table)
    return curves_m


def _sampled(controls_m: Array, spacing_m: float, table: int) -> Array:
    """Dense curves, whose parameters at equal steps of length are interpolated in so many samples."""
    u = np.linspace(0.0, 1.0, table)
    rows = bspline.sampled_basis(controls_m.shape[1], table)
    flown_m = [time_law.arc_length(rows @ control_m) for control_m in controls_m]
    longest_m = max(float(along_m[-1]) for along_m in flown_m)
    count = max(int(np.ceil(longest_m / (SPARE * spacing_m))) + 1, 3)
    knots = bspline.clamped_knots(controls_m.shape[1])
    curves_m = np.empty((len(controls_m), count, 3))
    for curve_m, control_m, along_m in zip(curves_m, controls_m, flown_m, strict=True):
        even_m = np.linspace(0.0, float(along_m[-1]), count)
        curve_m[:] = BSpline(knots, control_m, bspline.DEGREE)(np.interp(even_m, along_m, u))
        curve_m[0], curve_m[-1] = control_m[0], control_m[-1]
    return curves_m


def cross(a: Array, b: Array) -> Array:
    """(..., 3) cross products; several times as fast as `numpy.cross`."""
    (ae, an, au), (be, bn, bu) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    return np.stack((an * bu - au * bn, au * be - ae * bu, ae * bn - an * be), axis=-1)


def path_lengths(curves_m: Array) -> Array:
    """(...,) lengths [m] of (..., m, 3) curves."""
    return lengths(np.diff(curves_m, axis=-2)).sum(axis=-1)


def lengths(vectors: Array) -> Array:
    """(...,) Euclidean lengths of (..., 3) vectors; several times as fast as `numpy.linalg.norm` along an axis."""
    return _length(vectors[..., 0], vectors[..., 1], vectors[..., 2])


def passing_samples(curve_m: Array, stops_m: Array) -> list[int]:
    """Indices of the samples of an (m, 3) curve that are nearest to (k, 3) places passed one after the other."""
    passed: list[int] = []
    for stop_m in stops_m:
        after = passed[-1] if passed else 0
        passed.append(after + int(np.argmin(lengths(curve_m[after:] - stop_m))))
    return passed


def curvature(curves_m: Array) -> Array:
    """(..., m) curvature [1/m] of densely sampled (..., m, 3) curves.

    It is that of the circle through each sample and its neighbours; the outer two have their neighbours'.
    """
    steps_m = np.diff(curves_m, axis=-2)
    east, north, up = np.ascontiguousarray(np.moveaxis(steps_m, -1, 0))  # contiguous: several times as fast
    step_m = _length(east, north, up)
    before, after = (east[..., :-1], north[..., :-1], up[..., :-1]), (east[..., 1:], north[..., 1:], up[..., 1:])
    over_both_m = _length(*(one + next_one for one, next_one in zip(before, after, strict=True)))
    doubled_area = _length(
        before[1] * after[2] - before[2] * after[1],
        before[2] * after[0] - before[0] * after[2],
        before[0] * after[1] - before[1] * after[0],
    )
    inner = 2.0 * doubled_area / np.maximum(step_m[..., :-1] * step_m[..., 1:] * over_both_m, 1e-12)
    return np.concatenate((inner[..., :1], inner, inner[..., -1:]), axis=-1)


def _length(east: Array, north: Array, up: Array) -> Array:
    return np.sqrt(east * east + north * north + up * up)
