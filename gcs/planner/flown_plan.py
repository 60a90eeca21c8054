"""A plan that is being flown, as the beginning of the search for the next one, and what a change of it costs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from gcs.planner.curves import lengths
from gcs.planner.plan import TimedCurve
from gcs.planner.problem import Route, Way
from missions.mission import Mission

Array = npt.NDArray[np.float64]

CORNER_SHARE = 0.25
"""A way along a curve leaves it by this share of the required clearance at most."""
CHANGE_WEIGHT = 0.1
"""A new curve that is a metre off the old one, on the mean, costs as much as so many metres of way."""
EVERY = 4
"""Of a new curve's samples are looked at for that."""


@dataclass(frozen=True)
class FlownPlan:
    """What is left of the curves that vehicles fly.

    Args:
        curves_m: by system id, (m, 3) ENU samples; vehicles without one have none to keep to.
    """

    curves_m: Mapping[int, Array] = field(default_factory=dict[int, Array])

    def ways(self, mission: Mission, routes: Sequence[Route]) -> list[Way] | None:
        """Along the curves for those whose curve leads through their targets, else straight; None if all are straight.

        Args:
            mission: for its tolerances.
            routes: who goes where.
        """
        found = [self._way(mission, route) for route in routes]
        if not any(found):
            return None
        return [way or route.straight for way, route in zip(found, routes, strict=True)]

    def change_cost(self, mission: Mission, curves: Sequence[TimedCurve]) -> float:
        """What it costs that curves differ from those that are flown, in the unit of eq. 13."""
        off_m = sum(self._off_m(curve) for curve in curves)
        return CHANGE_WEIGHT * mission.planner.length_weight * off_m

    def _off_m(self, curve: TimedCurve) -> float:
        """Mean distance of a vehicle's new curve from its old one [m]."""
        old_m = self.curves_m.get(curve.sysid)
        if old_m is None:
            return 0.0
        return float(np.mean(KDTree(old_m).query(curve.curve_m[::EVERY])[0]))

    def _way(self, mission: Mission, route: Route) -> Way | None:
        curve_m = self.curves_m.get(route.sysid)
        if curve_m is None or len(curve_m) < 2:
            return None
        passed = _passed_at(curve_m, route.places_m[1:])
        ends_m = np.concatenate((curve_m[:1], curve_m[passed]))
        if np.any(np.diff(passed, prepend=0) <= 0) or lengths(ends_m - route.places_m).max() > _tolerance_m(mission):
            return None
        kept = [0]
        for place in passed:
            kept += _corners(curve_m, kept[-1], place, CORNER_SHARE * mission.limits.clearance_m)
        corners_m, stops = curve_m[kept], tuple(kept.index(place) for place in passed)
        corners_m[[0, *stops]] = route.places_m
        return Way(corners_m, stops[:-1])


def _tolerance_m(mission: Mission) -> float:
    return max(mission.site.arrival_tolerance_m, mission.limits.clearance_m)


def _passed_at(curve_m: Array, places_m: Array) -> list[int]:
    """Indices of the samples at which a curve comes nearest to (k, 3) places, in their order; the last one ends it."""
    passed: list[int] = []
    for place_m in places_m[:-1]:
        begin = passed[-1] if passed else 0
        passed.append(begin + int(np.argmin(lengths(curve_m[begin:] - place_m))))
    return [*passed, len(curve_m) - 1]


def _corners(curve_m: Array, first: int, last: int, tolerance_m: float) -> list[int]:
    """Indices after `first`, up to `last`, of the corners of a polygon from which the curve is nowhere farther."""
    span = curve_m[last] - curve_m[first]
    share = np.clip((curve_m[first : last + 1] - curve_m[first]) @ span / max(float(span @ span), 1e-12), 0.0, 1.0)
    off_m = lengths(curve_m[first : last + 1] - curve_m[first] - share[:, None] * span)
    middle = first + int(np.argmax(off_m))
    if off_m.max() <= tolerance_m or middle in (first, last):
        return [last]
    return _corners(curve_m, first, middle, tolerance_m) + _corners(curve_m, middle, last, tolerance_m)


NO_FLOWN_PLAN = FlownPlan()
