"""A plan made by rule, for pages that have to show one: from start to target in a bow, at cruise speed."""

import numpy as np

from gcs.planner.plan import FleetPlan, Progress, VehiclePlan
from missions.mission import Mission, Target, Vehicle
from missions.mission_items import Track
from missions.time_law import arc_length, resample, times_along

SAMPLES = 200
TRACK_POINTS = 6
BOW_SHARE = 0.12


def scripted_plan(mission: Mission) -> FleetPlan:
    """A plan for all vehicles of a mission; nobody has checked it for obstacles."""
    targets = {target.name: target for target in mission.targets}
    chosen = mission.routes or {v.name: (t.name,) for v, t in zip(mission.vehicles, mission.targets, strict=False)}
    parts = [
        _part(mission, vehicle, targets[chosen[vehicle.name][0]], index)
        for index, vehicle in enumerate(mission.vehicles)
    ]
    return FleetPlan(
        mission=mission.name,
        algorithm="scripted",
        seed=0,
        evaluations=3000,
        wall_s=0.42,
        cpu_s=0.4,
        objective=sum(part.length_m for part in parts) * 0.2,
        feasible=True,
        violations=(),
        convergence=scripted_progress(20),
        vehicles=tuple(parts),
    )


def scripted_progress(steps: int) -> tuple[Progress, ...]:
    """A search that finds a feasible plan half-way."""
    return tuple(
        Progress(
            iteration=step,
            evaluations=150 * step,
            objective=1400.0 + 900.0 * float(np.exp(-step / 4)),
            feasible=step * 2 >= steps,
            share_done=step / steps,
        )
        for step in range(1, steps + 1)
    )


def _part(mission: Mission, vehicle: Vehicle, target: Target, index: int) -> VehiclePlan:
    start_m, end_m = mission.start_m(vehicle), np.array(target.position_m)
    along = np.linspace(0.0, 1.0, SAMPLES)
    way_m = end_m - start_m
    aside = np.array([-way_m[1], way_m[0], 0.0]) * BOW_SHARE * (1.0 if index % 2 else -1.0)
    points_m = start_m + along[:, None] * way_m + (4.0 * along * (1.0 - along))[:, None] * aside
    distance_m = arc_length(points_m)
    curve_m = resample(points_m, distance_m, np.linspace(0.0, distance_m[-1], SAMPLES))
    speed_m_s = mission.limits.cruise_speed_m_s
    track_m = curve_m[np.linspace(0, SAMPLES - 1, TRACK_POINTS + 1).astype(int)[1:]]
    return VehiclePlan(
        name=vehicle.name,
        sysid=vehicle.sysid,
        targets=(target,),
        curve_m=curve_m,
        times_s=times_along(curve_m, np.full(SAMPLES, speed_m_s)),
        track=Track(track_m, np.full(TRACK_POINTS, speed_m_s)),
        length_m=float(distance_m[-1]),
    )
