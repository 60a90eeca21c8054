"""From control points to dense curves: samples equally spaced along every curve, as many for all vehicles."""

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline

from missions import bspline, time_law

Array = npt.NDArray[np.float64]

TABLE = 1024
"""Samples from which the parameter is found at which a curve has a given length."""
SPARE = 0.99
"""Samples lie at most this share of the allowed spacing apart."""


def dense_curves(controls_m: Array, spacing_m: float) -> list[Array]:
    """(m, 3) samples of each curve at equal steps of its length, at most `spacing_m` apart on the longest one.

    Args:
        controls_m: (vehicles, n, 3) control points, ENU [m].
        spacing_m: between samples.
    """
    u = np.linspace(0.0, 1.0, TABLE)
    rows = bspline.sampled_basis(controls_m.shape[1], TABLE)
    lengths_m = [time_law.arc_length(rows @ control_m) for control_m in controls_m]
    longest_m = max(length_m[-1] for length_m in lengths_m)
    count = max(int(np.ceil(longest_m / (SPARE * spacing_m))) + 1, 3)
    knots, curves = bspline.clamped_knots(controls_m.shape[1]), []
    for control_m, length_m in zip(controls_m, lengths_m, strict=True):
        at = np.interp(np.linspace(0.0, length_m[-1], count), length_m, u)
        curve_m = BSpline(knots, control_m, bspline.DEGREE)(at)
        curve_m[0], curve_m[-1] = control_m[0], control_m[-1]
        curves.append(curve_m)
    return curves
