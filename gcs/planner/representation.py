"""How a plan is written as numbers: offsets of B-spline control points from a guide path, which is mostly straight.

Each inner control point may move sideways and up or down, seen along the guide path; an offset of one is half the
search range, the `reach`. Nothing moves along the path. All offsets zero is the guide path itself, flown evenly.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gcs.planner.curves import cross, lengths
from missions import bspline, time_law
from missions.world import Bounds

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

EAST, NORTH = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])

REACH_SHARE = 0.5
"""Offsets reach at most this share of the distance from start to target, or across the flight range."""

LATERAL_BOWS = (0.0, 0.15, -0.15, 0.35, -0.35, 0.6, -0.6)
VERTICAL_BOWS = (0.0, 0.25, 0.5, -0.25)
"""Offsets in the middle of the first particles' curves."""
MOST_SKEW = 2.0
"""Fresh bows 4 s (1 - s) are bent by s = t^p, p from 1 / 2 to 2: widest after 25 % to 71 % of the way."""


LEG_SEGMENTS = 3
"""The curve between two targets of one vehicle has at least so many polynomial segments."""


@dataclass(frozen=True)
class Guide:
    """The guide path of one vehicle: (n, 3) control points without offsets, and what offsets of one move them by.

    Args:
        base_m: (n, 3) ENU, start and target included.
        axes_m: (n - 2, 2, 3) lateral and vertical axis of each inner control point, as long as the reach.
        pins: (k,) indices of the control points that follow from their neighbours, because the curve passes the
            targets on the way at the knots in the middle of what these control points touch.
    """

    base_m: Array
    axes_m: Array
    pins: IntArray


@functools.lru_cache(maxsize=64)
def abscissae(n_control: int) -> Array:
    """(n,) Greville abscissae: control points there on a straight line give a curve that is flown evenly."""
    knots = bspline.clamped_knots(n_control)
    where = np.lib.stride_tricks.sliding_window_view(knots[1:-1], bspline.DEGREE).mean(axis=1)
    where.flags.writeable = False
    return where


@functools.lru_cache(maxsize=64)
def pin_weights(n_control: int) -> Array:
    """(n, 3) what each control point and its two neighbours weigh at the knot in the middle of what it touches.

    Rows of the outer two control points at each end, where there is no such knot, are zero.
    """
    weights = np.zeros((n_control, 3))
    inner = np.arange(2, n_control - 2)
    rows = bspline.basis(n_control, (inner - 1) / (n_control - bspline.DEGREE))
    weights[2:-2] = np.take_along_axis(rows, inner[:, None] + np.array([-1, 0, 1]), axis=1)
    weights.flags.writeable = False
    return weights


def guide_along(path_m: Array, n_control: int, bounds: Bounds, stops: Sequence[int] = ()) -> Guide:
    """A guide along an (m, 3) polygon: control points at equal steps of its legs, axes across its direction.

    Args:
        path_m: (m, 3) corners from start to last target.
        n_control: n.
        bounds: offsets reach no farther than these are wide.
        stops: indices of the corners on the way that are targets themselves; they divide the path into legs.
    """
    lengths_m = time_law.arc_length(path_m)
    legs_m = lengths_m[[0, *stops, len(path_m) - 1]]
    segments = n_control - bspline.DEGREE
    knots = np.concatenate(([0], np.cumsum(_shared(segments, np.diff(legs_m)))))
    where_m = np.interp(abscissae(n_control) * segments, knots, legs_m)
    base_m = time_law.resample(path_m, lengths_m, where_m)
    reach_m = np.full(n_control - 2, REACH_SHARE * lengths_m[-1])
    return Guide(base_m, _axes(base_m[2:] - base_m[:-2], reach_m, bounds), knots[1:-1].astype(np.int64) + 1)


def straight_legs(begins_m: Array, ends_m: Array, n_control: int, bounds: Bounds) -> tuple[Array, Array]:
    """Base (k, n, 3) and axes (k, n - 2, 2, 3) of the guides along k straight lines between (k, 3) places."""
    legs_m = ends_m - begins_m
    bases_m = begins_m[:, None] + abscissae(n_control)[:, None] * legs_m[:, None]
    axes_m = _axes(legs_m, REACH_SHARE * lengths(legs_m), bounds)
    return bases_m, np.repeat(axes_m[:, None], n_control - 2, axis=1)


def _shared(segments: int, legs_m: Array) -> IntArray:
    """(k,) how many of the curve's segments each leg gets: as its length, but at least `LEG_SEGMENTS`."""
    spare = segments - LEG_SEGMENTS * len(legs_m)
    if len(legs_m) > 1 and spare < 0:
        raise ValueError(f"{len(legs_m)} legs need {LEG_SEGMENTS * len(legs_m)} segments, found {segments}")
    ideal = spare * np.cumsum(legs_m) / max(float(legs_m.sum()), 1e-9)
    ideal[-1] = spare
    return LEG_SEGMENTS + np.diff(np.round(ideal).astype(np.int64), prepend=0)


def bows(n_control: int) -> Array:
    """(particles, 2 (n - 2)) offsets of the deterministic first particles: the guide path bent to all sides."""
    t = abscissae(n_control)[1:-1]
    shape = 4.0 * t * (1.0 - t)
    ways = [(lateral, vertical) for vertical in VERTICAL_BOWS for lateral in LATERAL_BOWS]
    return np.einsum("k,pa->pka", shape, np.array(ways)).reshape(len(ways), -1)


def fresh_bows(rng: np.random.Generator, count: int, n_control: int) -> Array:
    """(count, 2 (n - 2)) offsets of random bows, each the sum of one to a side and one up or down."""
    t = abscissae(n_control)[1:-1]
    skewed = t ** (MOST_SKEW ** rng.uniform(-1.0, 1.0, (count, 2, 1)))
    heights = rng.uniform(-1.0, 1.0, (count, 2, 1)) * np.array([max(LATERAL_BOWS), max(VERTICAL_BOWS)])[:, None]
    return (4.0 * heights * skewed * (1.0 - skewed)).transpose(0, 2, 1).reshape(count, 2 * len(t))


def _axes(directions: Array, reach_m: Array, bounds: Bounds) -> Array:
    """(k, 2, 3) axes across (k, 3) directions, level to the left and upwards, as long as the reach and the range."""
    lengths_m = lengths(directions)[:, None]
    along = np.where(lengths_m > 0.0, directions / np.maximum(lengths_m, 1e-9), EAST)
    lateral = np.stack((-along[:, 1], along[:, 0], np.zeros(len(along))), axis=-1)
    lateral[lengths(lateral) < 1e-6] = NORTH
    lateral /= lengths(lateral)[:, None]
    size_m = bounds.high_enu_m - bounds.low_enu_m
    reaches_m = np.minimum(reach_m[:, None], [max(size_m[:2]), size_m[2]])[..., None]
    return reaches_m * np.stack((lateral, cross(along, lateral)), axis=1)
