"""From a dense curve to the few track points and leg speeds that an autopilot is given."""

import numpy as np
import numpy.typing as npt

from gcs.planner.curves import passing_samples, path_lengths
from gcs.planner.timing import Timing
from missions.kernels import compiled
from missions.mission import Mission, Site
from missions.mission_items import Track

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

MOST_POINTS = 20
TOLERANCE_SHARE = 1.0 / 6.0
"""Legs stay within this share of the limit of clearance of the curve: 0.1 m of 0.6 m."""
LOOKED_AT = 400
"""Samples of a curve among which track points are chosen."""
LEAST_TOLERANCE_M = 0.05
COARSER = 1.3
SPEED_STEP_M_S = {Site.INDOOR: 0.1, Site.OUTDOOR: 0.01}
"""Leg speeds are multiples of this. Long legs need the finer one, or the vehicles would not arrive together."""


def sample_track(mission: Mission, curve_m: Array, timing: Timing, stops_m: Array) -> Track:
    """The track of one vehicle: its launch point is left out, its last point is the target.

    The (k, 3) targets on the way are points of it. Legs begin and end where the fleet starts or ends to fly at
    avoidance speed, so that no leg is faster than its slowest part may be. Between these as few points are kept as hold
    the polygon to its tolerance, which grows until there are no more than `MOST_POINTS`.
    """
    passed = passing_samples(curve_m, stops_m)
    slowed = (np.flatnonzero(np.diff(timing.held_back)) + 1).tolist()
    fixed = np.unique([0, *slowed, *passed, len(curve_m) - 1])
    looked_at = np.union1d(fixed, np.linspace(0, len(curve_m) - 1, min(LOOKED_AT, len(curve_m))).astype(int))
    tolerance_m = max(TOLERANCE_SHARE * mission.limits.clearance_m, LEAST_TOLERANCE_M)
    kept = looked_at[_thinned(curve_m[looked_at], np.searchsorted(looked_at, fixed), tolerance_m)]
    while len(kept) > max(MOST_POINTS + 1, len(fixed)):
        tolerance_m *= COARSER
        kept = looked_at[_thinned(curve_m[looked_at], np.searchsorted(looked_at, fixed), tolerance_m)]
    points_m = curve_m[kept[1:]]
    points_m[np.searchsorted(kept[1:], passed)] = stops_m
    return Track(points_m, _leg_speeds(mission, curve_m, timing, kept))


def _thinned(curve_m: Array, fixed: IntArray, tolerance_m: float) -> IntArray:
    """Indices of samples between which straight legs stay within `tolerance_m`; those that are fixed among them."""
    kept = np.zeros(len(curve_m), np.bool_)
    kept[fixed] = True
    thin(curve_m, fixed, tolerance_m, kept)
    return np.flatnonzero(kept)


@compiled
def thin(curve_m: Array, fixed: IntArray, tolerance_m: float, kept: BoolArray) -> None:
    """Mark the samples of an (m, 3) curve that Douglas and Peucker keep between the fixed ones."""
    begins, ends = np.empty(len(curve_m), np.int64), np.empty(len(curve_m), np.int64)
    waiting = len(fixed) - 1
    begins[:waiting], ends[:waiting] = fixed[:-1], fixed[1:]
    while waiting > 0:
        waiting -= 1
        begin, end = begins[waiting], ends[waiting]
        farthest, worst = tolerance_m, -1
        for i in range(begin + 1, end):
            off_m = _distance_to_leg(curve_m, i, begin, end)
            if off_m > farthest:
                farthest, worst = off_m, i
        if worst >= 0:
            kept[worst] = True
            begins[waiting], ends[waiting] = begin, worst
            begins[waiting + 1], ends[waiting + 1] = worst, end
            waiting += 2


@compiled
def _distance_to_leg(curve_m: Array, i: int, begin: int, end: int) -> float:
    """Distance of a sample to the straight leg between two others."""
    squared, along = 0.0, 0.0
    for axis in range(3):
        leg_m = curve_m[end, axis] - curve_m[begin, axis]
        along += (curve_m[i, axis] - curve_m[begin, axis]) * leg_m
        squared += leg_m * leg_m
    along = min(max(along / max(squared, 1e-12), 0.0), 1.0)
    squared = 0.0
    for axis in range(3):
        foot_m = curve_m[begin, axis] + along * (curve_m[end, axis] - curve_m[begin, axis])
        squared += (curve_m[i, axis] - foot_m) ** 2
    return np.sqrt(squared)


def _leg_speeds(mission: Mission, curve_m: Array, timing: Timing, kept: IntArray) -> Array:
    """(legs,) speeds that keep step with the fleet; rounded, but never up where somebody avoids something."""
    step_m_s = SPEED_STEP_M_S[mission.site]
    length_m = float(path_lengths(curve_m))
    steady_1_s = np.empty_like(timing.allowed_1_s)
    for run in np.split(np.arange(len(steady_1_s)), np.flatnonzero(np.diff(timing.held_back)) + 1):
        steady_1_s[run] = timing.allowed_1_s[run].min()
    steps = length_m * steady_1_s[kept[:-1]] / step_m_s
    whole = np.where(timing.held_back[kept[:-1]], np.floor(steps + 1e-6), np.round(steps))
    return np.clip(whole * step_m_s, step_m_s, mission.limits.cruise_speed_m_s)
