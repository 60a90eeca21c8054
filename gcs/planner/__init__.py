"""The cloud planner: targets are allocated, curves and approximate track points planned for all vehicles together.

Layers, each importing only what stands below it:

    planner                              plan_mission: the way in
    search, baselines                    swarms, polish and judge in turn; what they are compared with
    allocation, target_order             who flies where, and in which order
    cooperation, guide_path              one swarm per vehicle; ways around obstacles
    assembly                             the plan that is handed out
    feasibility                          the judge of it
    timing, track_points, objective      times, track points and eq. 13 of dense curves
    lone_descent, refinement, lbfgs      descents of single vehicles, and of the whole plan
    flown_plan                           the plan that is flown meanwhile, as a beginning, and what a change costs
    problem, representation              a mission as numbers
    fleet_cost, coupling, joining, curve_cost, obstacle_gradient    compiled costs with gradients
    ecpso, plan, limits, budget, curves  the swarm itself; plain data, definitions, geometry
"""

from gcs.planner.flown_plan import NO_FLOWN_PLAN, FlownPlan
from gcs.planner.plan import FleetPlan, Limit, Progress, VehiclePlan, Violation
from gcs.planner.planner import ALGORITHMS, compile_kernels, plan_mission
from gcs.planner.search import SearchSettings

__all__ = [
    "ALGORITHMS",
    "NO_FLOWN_PLAN",
    "FleetPlan",
    "FlownPlan",
    "Limit",
    "Progress",
    "SearchSettings",
    "VehiclePlan",
    "Violation",
    "compile_kernels",
    "plan_mission",
]
