"""From control points to a plan that can be handed out, and judged."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gcs.planner import feasibility
from gcs.planner.curves import dense_curves
from gcs.planner.objective import objective
from gcs.planner.plan import VehiclePlan, Violation
from gcs.planner.problem import Route
from gcs.planner.timing import common_timing
from gcs.planner.track_points import sample_track
from missions import time_law
from missions.mission import Mission

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Candidate:
    """A plan with its objective (eq. 13) and the judge's verdict."""

    vehicles: tuple[VehiclePlan, ...]
    objective: float
    violations: tuple[Violation, ...]


def assemble(mission: Mission, routes: Sequence[Route], controls_m: Array) -> Candidate:
    """Dense curves, times, tracks and verdict for (vehicles, n, 3) control points, ENU [m]."""
    curves_m = dense_curves(controls_m, feasibility.SPACING_M[mission.site])
    timing = common_timing(mission, curves_m)
    vehicles = tuple(
        VehiclePlan(
            name=route.name,
            sysid=route.sysid,
            target=route.target,
            curve_m=curve_m,
            times_s=timing.times_s,
            track=sample_track(mission, curve_m, timing),
            length_m=float(time_law.arc_length(curve_m)[-1]),
        )
        for route, curve_m in zip(routes, curves_m, strict=True)
    )
    return Candidate(vehicles, objective(mission, curves_m), feasibility.violations(mission, vehicles))
