"""From control points to a plan that can be handed out, and judged."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gcs.planner import feasibility
from gcs.planner.curves import dense_curves, path_lengths
from gcs.planner.objective import objective
from gcs.planner.plan import TimedCurve, VehiclePlan, Violation
from gcs.planner.problem import Route
from gcs.planner.timing import Timing, common_timing
from gcs.planner.track_points import sample_track
from missions.mission import Mission

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Candidate:
    """A plan with its objective (eq. 13) and the judge's verdict."""

    curves: tuple[TimedCurve, ...]
    timing: Timing
    objective: float
    violations: tuple[Violation, ...]


def judged(mission: Mission, routes: Sequence[Route], controls_m: Array) -> Candidate:
    """Dense curves, times and verdict for (vehicles, n, 3) control points, ENU [m]."""
    curves_m = dense_curves(controls_m, feasibility.SPACING_M[mission.site])
    measured = feasibility.measure(mission, curves_m)
    timing = common_timing(mission, curves_m, measured.clearance_m, measured.curvature_1_m)
    curves = tuple(
        TimedCurve(route.name, route.sysid, route.targets, curve_m, timing.times_s)
        for route, curve_m in zip(routes, curves_m, strict=True)
    )
    found = feasibility.violations(mission, curves, measured)
    return Candidate(curves, timing, objective(mission, curves_m, measured.clearance_m, measured.height_m), found)


def vehicle_plans(mission: Mission, candidate: Candidate) -> tuple[VehiclePlan, ...]:
    """What is handed out: the curves, and the tracks sampled from them."""
    return tuple(
        VehiclePlan(
            name=curve.name,
            sysid=curve.sysid,
            targets=curve.targets,
            curve_m=curve.curve_m,
            times_s=curve.times_s,
            track=sample_track(mission, curve.curve_m, candidate.timing, curve.stops_m),
            length_m=float(path_lengths(curve.curve_m)),
        )
        for curve in candidate.curves
    )
