"""What vehicles owe to one another: separation and mean separation, with derivatives.

All vehicles arrive together: at any time all have flown the same fraction of their paths. They are compared at their
places at k equally spaced fractions, and along straight lines between these; with time slack, at unequal fractions too.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from missions.kernels import compiled

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


class Coupling(NamedTuple):
    """Limits between vehicles, as the search uses them."""

    separation_m: float
    zone_radius_m: float
    """While both vehicles are in a launch zone of this radius, only contact counts ..."""
    contact_m: float
    """... which is a separation of less than this ..."""
    join_m: float
    """... and not before they have come this far from where they start."""
    mean_low_m: float
    """Bounds of a vehicle's mean distance to the others."""
    mean_high_m: float
    mean_unit_m: float
    """A violation of these bounds by so much counts as one."""
    first: IntArray
    """(k,) with time slack: the earliest fraction at which another vehicle may be, when this one is at k ..."""
    last: IntArray
    """... and the latest, inclusive."""


@compiled
def at_fractions(points_m: Array, chords_m: Array, out_m: Array, side: IntArray, share: Array) -> float:
    """Fill (k, 3) `out_m` with points of a polygon at equal fractions of its length.

    Args:
        points_m: (m, 3) corners.
        chords_m: (m - 1,) lengths of its sides.
        out_m: (k, 3) the points.
        side: (k,) is filled with the side on which each point lies.
        share: (k,) is filled with how far along that side, 0 to 1.

    Returns:
        How far apart [m] they lie along the polygon.
    """
    n_fractions, n_sides = len(out_m), len(chords_m)
    length = chords_m.sum()
    m, begin = 0, 0.0
    for k in range(n_fractions):
        at = length * k / (n_fractions - 1)
        while m < n_sides - 1 and begin + chords_m[m] < at:
            begin += chords_m[m]
            m += 1
        along = min(max((at - begin) / chords_m[m], 0.0), 1.0)
        side[k], share[k] = m, along
        for axis in range(3):
            out_m[k, axis] = points_m[m, axis] + along * (points_m[m + 1, axis] - points_m[m, axis])
    return length / (n_fractions - 1)


@compiled
def from_fractions(
    points_m: Array,
    chords_m: Array,
    side: IntArray,
    share: Array,
    by_place: Array,
    by_point: Array,
    by_chord: Array,
) -> None:
    """Add what (k, 3) derivatives by the places of `at_fractions` mean for the polygon's corners and sides.

    A place lies on its side at share = (fraction * length - length of the sides before) / side.
    """
    n_fractions, n_sides = len(side), len(chords_m)
    before, everywhere = np.zeros(n_sides), 0.0
    for k in range(n_fractions):
        m, a = side[k], share[k]
        by_share = 0.0
        for axis in range(3):
            by_point[m, axis] += (1.0 - a) * by_place[k, axis]
            by_point[m + 1, axis] += a * by_place[k, axis]
            by_share += by_place[k, axis] * (points_m[m + 1, axis] - points_m[m, axis])
        by_share /= chords_m[m]
        if 0 < k < n_fractions - 1:
            everywhere += by_share * k / (n_fractions - 1)
            before[m] -= by_share
            by_chord[m] -= a * by_share
    for m in range(n_sides - 1, -1, -1):
        by_chord[m] += everywhere
        everywhere += before[m]


@compiled
def mean_distance(a_m: Array, b_m: Array) -> float:
    """Mean over the flight of the distance between two vehicles at (k, 3) places."""
    last = len(a_m) - 1
    total = 0.5 * (_distance(a_m, 0, b_m, 0) + _distance(a_m, last, b_m, last))
    for k in range(1, last):
        total += _distance(a_m, k, b_m, k)
    return total / last


@compiled
def add_mean_gradient(a_m: Array, b_m: Array, scale: float, by_a: Array, by_b: Array) -> None:
    """Add `scale` times the derivatives of `mean_distance` to (k, 3) `by_a` and `by_b`."""
    last = len(a_m) - 1
    for k in range(last + 1):
        weight = scale / last * (0.5 if k in (0, last) else 1.0) / max(_distance(a_m, k, b_m, k), 1e-9)
        for axis in range(3):
            pull = weight * (a_m[k, axis] - b_m[k, axis])
            by_a[k, axis] += pull
            by_b[k, axis] -= pull


@compiled
def out_of_bounds(mean_m: float, coupling: Coupling) -> float:
    """Violation of the bounds of a mean separation in units of `mean_unit_m`, negative below them."""
    out_m = max(0.0, mean_m - coupling.mean_high_m) - max(0.0, coupling.mean_low_m - mean_m)
    return out_m / coupling.mean_unit_m


@compiled
def too_close(
    a_m: Array, b_m: Array, steps_m: float, b_step_m: float, coupling: Coupling, pull: float, by_a: Array, by_b: Array
) -> float:
    """Sum of the squared violations of the separation of two vehicles at (k, 3) places.

    Args:
        a_m: places of one vehicle.
        b_m: places of the other.
        steps_m: how far both may fly from one place to the next, added up.
        b_step_m: how far the other may.
        coupling: the limits.
        pull: penalty weight of the derivatives, 0 when they are not wanted.
        by_a: (k, 3) to which the derivatives by a's places are added.
        by_b: (k, 3) likewise.
    """
    n_steps, violation, separation_m = len(a_m) - 1, 0.0, coupling.separation_m
    first, last = coupling.first, coupling.last
    for k in range(n_steps):
        j, end = first[k], min(last[k] + 1, n_steps)
        while j < end:
            spare_m = _distance(a_m, k, b_m, j) - separation_m - steps_m
            if spare_m > 0.0:
                j += 1 + int(spare_m / max(b_step_m, 1e-9))  # the other one cannot come near any sooner
                continue
            limit_m = separation_m
            if coupling.zone_radius_m > 0.0:
                limit_m = _limit_near_start(a_m, k, b_m, j, coupling)
            violation += _pass(a_m, k, b_m, j, limit_m, pull, by_a, by_b)
            j += 1
    return violation


@compiled
def _pass(a_m: Array, k: int, b_m: Array, j: int, limit_m: float, pull: float, by_a: Array, by_b: Array) -> float:
    """Squared violation of a limit where two vehicles are nearest while they fly one step from places k and j."""
    e, n, u = a_m[k, 0] - b_m[j, 0], a_m[k, 1] - b_m[j, 1], a_m[k, 2] - b_m[j, 2]
    de = a_m[k + 1, 0] - b_m[j + 1, 0] - e
    dn = a_m[k + 1, 1] - b_m[j + 1, 1] - n
    du = a_m[k + 1, 2] - b_m[j + 1, 2] - u
    t = min(max(-(e * de + n * dn + u * du) / max(de * de + dn * dn + du * du, 1e-12), 0.0), 1.0)
    e, n, u = e + t * de, n + t * dn, u + t * du
    apart_m = np.sqrt(e * e + n * n + u * u)
    if apart_m >= limit_m:
        return 0.0
    short = 1.0 - apart_m / limit_m
    if pull > 0.0:
        scale = -2.0 * pull * short / limit_m / max(apart_m, 1e-9)
        _add(by_a, k, t, scale * e, scale * n, scale * u)
        _add(by_b, j, t, -scale * e, -scale * n, -scale * u)
    return short * short


@compiled
def _limit_near_start(a_m: Array, k: int, b_m: Array, j: int, coupling: Coupling) -> float:
    """Least separation [m] while two vehicles fly one step from places k and j: less while both are in launch zones."""
    if max(_distance(a_m, k + 1, a_m, 0), _distance(b_m, j + 1, b_m, 0)) > coupling.zone_radius_m:
        return coupling.separation_m
    joined = min(_distance(a_m, k, a_m, 0), _distance(b_m, j, b_m, 0)) > coupling.join_m
    return coupling.contact_m if joined else 0.0


@compiled
def _distance(a_m: Array, k: int, b_m: Array, j: int) -> float:
    east, north, up = a_m[k, 0] - b_m[j, 0], a_m[k, 1] - b_m[j, 1], a_m[k, 2] - b_m[j, 2]
    return np.sqrt(east * east + north * north + up * up)


@compiled
def _add(total: Array, k: int, t: float, east: float, north: float, up: float) -> None:
    """Share a derivative by a place between fractions k and k + 1 among the two."""
    total[k, 0] += (1.0 - t) * east
    total[k, 1] += (1.0 - t) * north
    total[k, 2] += (1.0 - t) * up
    total[k + 1, 0] += t * east
    total[k + 1, 1] += t * north
    total[k + 1, 2] += t * up
