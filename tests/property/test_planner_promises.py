"""Whatever the room looks like: a plan that is called feasible keeps its limits, measured with other code."""

import itertools
import math

import msgspec
import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gcs.planner import FleetPlan, plan_mission
from missions.mission import Mission
from missions.world import Box, Cylinder
from tests.unit.gcs.planner.worlds import room

LANES_M = [2.0, 4.5, 7.0, 9.5, 12.0]

EAST_M, NORTH_M, TOP_M = st.floats(5.0, 15.0), st.floats(1.0, 14.0), st.floats(1.0, 4.0)
BOXES = st.lists(st.tuples(EAST_M, NORTH_M, st.floats(0.1, 1.0), st.floats(0.1, 2.5), TOP_M), max_size=3)
CYLINDERS = st.lists(st.tuples(EAST_M, NORTH_M, st.floats(0.1, 1.2), TOP_M), max_size=3)


@st.composite
def missions(draw: st.DrawFn) -> Mission:
    """One to three vehicles across a room with a few things standing in it, to targets in any order."""
    count = draw(st.integers(1, 3))
    starts, ends = draw(st.permutations(LANES_M))[:count], draw(st.permutations(LANES_M))[:count]
    mission = room(
        pads_m=tuple((1.5, north, 0.0) for north in starts), targets_m=tuple((18.5, north, 1.5) for north in ends)
    )
    world = msgspec.structs.replace(
        mission.world,
        boxes=tuple(
            Box(name=f"box-{i}", centre_m=(east, north, top / 2), half_m=(half_east, half_north, top / 2))
            for i, (east, north, half_east, half_north, top) in enumerate(draw(BOXES))
        ),
        cylinders=tuple(
            Cylinder(name=f"cylinder-{i}", centre_m=(east, north), radius_m=radius, top_m=top)
            for i, (east, north, radius, top) in enumerate(draw(CYLINDERS))
        ),
    )
    return msgspec.structs.replace(mission, world=world)


def to_box(point: np.ndarray, box: Box) -> float:
    nearest = np.clip(point, np.subtract(box.centre_m, box.half_m), np.add(box.centre_m, box.half_m))
    return math.dist(point, nearest)


def to_cylinder(point: np.ndarray, cylinder: Cylinder) -> float:
    across = max(math.dist(point[:2], cylinder.centre_m) - cylinder.radius_m, 0.0)
    return math.hypot(across, max(point[2] - cylinder.top_m, cylinder.base_m - point[2], 0.0))


def places(plan: FleetPlan, index: int, times_s: np.ndarray) -> np.ndarray:
    vehicle = plan.vehicles[index]
    return np.stack([np.interp(times_s, vehicle.times_s, vehicle.curve_m[:, axis]) for axis in range(3)], axis=-1)


@settings(max_examples=25, suppress_health_check=[HealthCheck.too_slow])
@given(mission=missions(), seed=st.integers(0, 1000))
def test_a_feasible_plan_keeps_its_limits(mission: Mission, seed: int):
    plan = plan_mission(mission, seed=seed, evaluations=220)
    assert plan.feasible == (plan.violations == ())
    if not plan.feasible:
        return
    limits, ends_s = mission.limits, plan.vehicles[0].times_s[-1]
    times_s = np.linspace(0.0, ends_s, 500)
    flown = [places(plan, index, times_s) for index in range(len(plan.vehicles))]
    for curve_m in flown:
        for point in curve_m[::2]:
            assert all(to_box(point, box) > limits.clearance_m - 1e-3 for box in mission.world.boxes)
            assert all(to_cylinder(point, thing) > limits.clearance_m - 1e-3 for thing in mission.world.cylinders)
            assert mission.world.bounds.contains(tuple(point))
            assert point[2] > limits.height_m - 1e-3
    for one, other in itertools.combinations(range(len(flown)), 2):
        for late_s in np.linspace(-2.0, 2.0, 17):
            apart_m = np.linalg.norm(flown[one] - places(plan, other, times_s + late_s), axis=1)
            assert apart_m.min() > limits.separation_m - 5e-3


@settings(max_examples=25, suppress_health_check=[HealthCheck.too_slow])
@given(mission=missions())
def test_tracks_follow_their_curves(mission: Mission):
    plan = plan_mission(mission, evaluations=60)
    for vehicle in plan.vehicles:
        corners_m = np.concatenate((vehicle.curve_m[:1], vehicle.track.points_m))
        legs_m = np.linalg.norm(np.diff(corners_m, axis=0), axis=1)
        assert legs_m.sum() <= vehicle.length_m + 1e-6
        assert np.all((vehicle.track.speeds_m_s > 0.0) & (vehicle.track.speeds_m_s <= mission.limits.cruise_speed_m_s))
        for corner_m in corners_m:
            assert np.linalg.norm(vehicle.curve_m - corner_m, axis=1).min() < 1e-9
