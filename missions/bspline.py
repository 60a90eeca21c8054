"""Cubic B-splines (eqs. 19-21): the clamped ones of the cloud's curves, the uniform ones of flown trajectories.

Equation 20 prints the last factor of its recursion as N_{i+1}^{k+1}; Cox and de Boor's recursion has
N_{i+1}^{k-1} there, and so has this code (docs/decisions/0006-errors-in-the-paper.md).
"""

import functools

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

DEGREE = 3

SEGMENT = np.array([[-1.0, 3.0, -3.0, 1.0], [3.0, -6.0, 3.0, 0.0], [-3.0, 0.0, 3.0, 0.0], [1.0, 4.0, 1.0, 0.0]]) / 6.0
"""The matrix of eq. 21: one uniform cubic segment is [u^3 u^2 u 1] @ SEGMENT @ [P0 P1 P2 P3]."""


def clamped_knots(n_control: int, degree: int = DEGREE) -> Array:
    """(n_control + degree + 1,) knots in [0, 1] of a curve that begins and ends in its outer control points.

    Raises:
        ValueError: fewer control points than `degree + 1`.
    """
    if n_control <= degree:
        raise ValueError(f"a B-spline of degree {degree} needs {degree + 1} control points, got {n_control}")
    inner = np.linspace(0.0, 1.0, n_control - degree + 1)
    return np.concatenate((np.zeros(degree), inner, np.ones(degree)))


def basis(n_control: int, u: Array, degree: int = DEGREE) -> Array:
    """(m, n_control) values N_i^degree(u) of the clamped basis (eq. 20) at (m,) parameters in [0, 1].

    Example:
        >>> rows = basis(6, np.array([0.0, 0.5, 1.0]))
        >>> rows.sum(axis=1).tolist()
        [1.0, 1.0, 1.0]
    """
    knots = clamped_knots(n_control, degree)
    u = np.clip(np.asarray(u, dtype=float), 0.0, 1.0)[:, None]
    last = knots < 1.0
    values = ((knots[:-1] <= u) & ((u < knots[1:]) | (last[:-1] & ~last[1:] & (u == 1.0)))).astype(float)
    for k in range(1, degree + 1):
        rising = _ratio(u - knots[: -k - 1], knots[k:-1] - knots[: -k - 1])
        falling = _ratio(knots[k + 1 :] - u, knots[k + 1 :] - knots[1:-k])
        values = rising * values[:, :-1] + falling * values[:, 1:]
    return values


@functools.lru_cache(maxsize=64)
def sampled_basis(n_control: int, n_samples: int) -> Array:
    """(n_samples, n_control) clamped basis at equally spaced parameters; cached, so do not write to it."""
    rows = basis(n_control, np.linspace(0.0, 1.0, n_samples))
    rows.flags.writeable = False
    return rows


def evaluate(control_m: Array, u: Array) -> Array:
    """(m, 3) points of the clamped cubic with (n, 3) control points at (m,) parameters in [0, 1] (eq. 19)."""
    return basis(len(control_m), u) @ control_m


def uniform_rows(u: Array) -> tuple[Array, Array, Array]:
    """(m, 4) weights of a uniform segment's four control points for value, first, second derivative (eq. 21)."""
    u = np.asarray(u, dtype=float)
    zero, one = np.zeros_like(u), np.ones_like(u)
    return (
        np.stack((u**3, u**2, u, one), axis=-1) @ SEGMENT,
        np.stack((3 * u**2, 2 * u, one, zero), axis=-1) @ SEGMENT,
        np.stack((6 * u, 2 * one, zero, zero), axis=-1) @ SEGMENT,
    )


def _ratio(numerator: Array, denominator: Array) -> Array:
    """numerator / denominator, with 0 / 0 = 0 as the recursion wants it at repeated knots."""
    safe = np.where(denominator > 0.0, denominator, 1.0)
    return np.where(denominator > 0.0, numerator / safe, 0.0)
