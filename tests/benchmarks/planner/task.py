"""What every contestant is given: a mission as numbers, targets allocated, with the product's evaluation and judge."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gcs.planner.allocation import allocate
from gcs.planner.assembly import Candidate, judged
from gcs.planner.curves import lengths
from gcs.planner.fleet_cost import Problem, all_control_points, fleet_cost, plan_costs
from gcs.planner.limits import clearance_cap_m
from gcs.planner.plan import TimedCurve
from gcs.planner.problem import Route, Way, control_points, guides, guides_along, pose
from gcs.planner.refinement import stricter
from missions import obstacles
from missions.mission import Mission

Array = npt.NDArray[np.float64]

STRICTNESS = 100.0
"""Violations weigh so much as in the last polish of the product: what all contestants minimise."""
POINTS_PER_CORNER = 3
"""Control points of curves that follow a path around obstacles."""


@dataclass(frozen=True)
class Task:
    """One mission, posed.

    Args:
        mission: what is to be planned.
        routes: who flies where.
        problem: the arrays that the compiled costs read.
    """

    mission: Mission
    routes: Sequence[Route]
    problem: Problem

    @property
    def shape(self) -> tuple[int, int]:
        """Vehicles, and offsets of each: together the variables."""
        vehicles, n_control = self.problem.base_m.shape[:2]
        return vehicles, 2 * (n_control - 2)

    @property
    def dimension(self) -> int:
        return self.shape[0] * self.shape[1]

    def costs(self, plans: Array) -> tuple[Array, Array]:
        """(p,) objectives and (p,) violations of (p, dimension) plans."""
        controls_m = self.control_points(plans)
        objective, violation = np.empty(len(plans)), np.empty(len(plans))
        plan_costs(self.problem, controls_m, objective, violation)
        return objective, violation

    def control_points(self, plans: Array) -> Array:
        """(p, vehicles, n, 3) control points, ENU [m], of (p, dimension) plans of vehicles with one target each."""
        assert self.problem.pins.shape[1] == 0, "the benchmark's vehicles fly to one target each"
        vehicles, n_control = self.problem.base_m.shape[:2]
        offsets = plans.reshape(len(plans), vehicles, n_control - 2, 2)
        controls_m = np.repeat(self.problem.base_m[None], len(plans), axis=0)
        controls_m[:, :, 1:-1] += np.einsum("pvia,viax->pvix", offsets, self.problem.axes_m)
        return controls_m

    def cost_and_gradient(self, plan: Array, strictness: float) -> tuple[float, float, Array]:
        """Objective and violation of one (dimension,) plan, and the gradient of their penalised sum."""
        gradient = np.empty(self.shape)
        objective, violation = fleet_cost(stricter(self.problem, strictness), plan.reshape(self.shape), gradient)
        return objective, violation, gradient.ravel()

    def judge(self, plan: Array) -> Candidate:
        """The plan as it would be handed out, with the verdict of `gcs.planner.feasibility`."""
        return judged(self.mission, self.routes, all_control_points(self.problem, plan.reshape(self.shape)))


def pose_straight(mission: Mission) -> Task:
    """Offsets from straight lines, as the product begins."""
    routes = allocate(mission)
    return Task(mission, routes, pose(mission, routes, guides(mission, routes)))


def pose_along(mission: Mission, paths_m: Sequence[Array]) -> Task:
    """Offsets from an (m, 3) path for every vehicle, with enough control points to follow it."""
    routes, ways = allocate(mission), [Way(path_m) for path_m in paths_m]
    n_control = control_points(mission, ways, POINTS_PER_CORNER)
    return Task(mission, routes, pose(mission, routes, guides_along(mission, ways, n_control)))


def flown_cost(mission: Mission, curves: Sequence[TimedCurve], objective: float) -> float:
    """Eq. 13 plus what slow flight near obstacles costs, over dense samples: what all contestants minimise.

    The search of the product charges the same from fewer samples (docs/maths/cloud-planner.md, section 1).
    """
    kept, solid = mission.limits, obstacles.pack(mission.world.as_known())
    if clearance_cap_m(mission, mission.world.as_known()) == 0.0:
        return objective
    direct_m = np.mean([np.linalg.norm(curve.curve_m[-1] - curve.curve_m[0]) for curve in curves])
    slow = 0.0
    for curve in curves:
        spare = (obstacles.clearance(curve.curve_m, solid) / max(kept.avoidance_distance_m, 1e-9) - 1.0) / 0.1
        share = np.clip(1.0 - spare, 0.0, 1.0)
        smooth = share * share * (3.0 - 2.0 * share)
        slow += float(np.average(0.5 * (smooth[1:] + smooth[:-1]), weights=lengths(np.diff(curve.curve_m, axis=0))))
    slower = kept.cruise_speed_m_s / kept.avoidance_speed_m_s - 1.0
    return objective + mission.planner.length_weight * slower * float(direct_m) * slow
