"""In any room: a plan is safe and within the limits, or there is none."""

import msgspec
import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from companion.planner.planner import Planner, PlanRequest
from companion.settings import Reserve, SearchSettings
from missions import obstacles
from missions.mission import Mission, load_mission
from missions.mission_items import Track
from missions.trajectory import Motion, Trajectory
from missions.world import Box, Cylinder

INDOOR = load_mission("indoor")
LIMITS = INDOOR.limits
QUICK = settings(max_examples=40)

EAST, NORTH, UP = st.floats(1.5, 18.5), st.floats(1.5, 13.5), st.floats(0.8, 3.2)
PLACES = st.tuples(EAST, NORTH, UP)
BOXES = st.builds(
    lambda centre, half: Box(name="box", centre_m=centre, half_m=half),
    PLACES,
    st.tuples(st.floats(0.1, 2.0), st.floats(0.1, 2.0), st.floats(0.2, 2.0)),
)
COLUMNS = st.builds(
    lambda east, north, radius, top: Cylinder(name="column", centre_m=(east, north), radius_m=radius, top_m=top),
    EAST,
    NORTH,
    st.floats(0.1, 1.5),
    st.floats(0.5, 4.0),
)
ROOMS = st.builds(
    lambda boxes, columns: msgspec.structs.replace(
        INDOOR,
        world=msgspec.structs.replace(INDOOR.world, boxes=tuple(boxes), cylinders=tuple(columns)),
    ),
    st.lists(BOXES, max_size=4),
    st.lists(COLUMNS, max_size=4),
)


def planner_of(room: Mission) -> Planner:
    zones_m = np.array([[1.0, 6.5, 1.5], [19.0, 8.5, 1.5]])
    return Planner(room, Reserve(), SearchSettings(), np.random.default_rng(0), zones_m)


def free_at(room: Mission, place: tuple[float, float, float]) -> float:
    return float(obstacles.clearance(np.array([place]), obstacles.pack(room.world))[0])


def assert_safe(trajectory: Trajectory, room: Mission) -> None:
    motion = trajectory.sample(trajectory.grid(0.02))
    free_m = obstacles.clearance(motion.position_m, obstacles.pack(room.world))
    from_start_m = np.linalg.norm(motion.position_m - motion.position_m[0], axis=1)
    from_end_m = np.linalg.norm(motion.position_m - motion.position_m[-1], axis=1)
    eased_m = np.minimum(free_m[0] + 0.5 * from_start_m, max(free_m[-1], LIMITS.body_radius_m) + 0.5 * from_end_m)
    assert np.all(free_m >= np.minimum(LIMITS.clearance_m, eased_m) - 0.02)
    assert free_m.min() >= min(LIMITS.body_radius_m, free_m[0]) - 1e-6
    speed = np.linalg.norm(motion.velocity_m_s, axis=1)
    assert speed.max() <= LIMITS.cruise_speed_m_s
    assert speed[free_m < LIMITS.avoidance_distance_m].max(initial=0.0) <= LIMITS.avoidance_speed_m_s + 0.2
    assert np.linalg.norm(motion.acceleration_m_s2, axis=1).max() <= 1.1 * LIMITS.acceleration_m_s2


@QUICK
@given(ROOMS, PLACES, PLACES)
def test_a_plan_from_rest_is_safe_or_there_is_none(room: Mission, start: tuple, target: tuple):
    assume(free_at(room, start) > 0.25)
    planner = planner_of(room)
    place_m = np.array(start)
    guide = planner.lay_guide(Track(np.array([target]), np.array([3.0])), 0, place_m)
    plan = planner.plan(PlanRequest(1, Motion(place_m, np.zeros(3), np.zeros(3)), 0.0, guide, 0.0))
    if plan.trajectory is not None:
        assert_safe(plan.trajectory, room)


@QUICK
@given(ROOMS, PLACES, PLACES)
def test_replanning_goes_on_until_the_target_is_reached_or_the_way_is_blocked(
    room: Mission, start: tuple, target: tuple
):
    assume(min(free_at(room, start), free_at(room, target)) > 0.8)
    assume(np.linalg.norm(np.array(start) - np.array(target)) > 1.0)
    planner = planner_of(room)
    place_m = np.array(start)
    guide = planner.lay_guide(Track(np.array([target]), np.array([3.0])), 0, place_m)
    plan = planner.plan(PlanRequest(1, Motion(place_m, np.zeros(3), np.zeros(3)), 0.0, guide, 0.0))
    for number in range(2, 60):
        if plan.trajectory is None:
            return  # no way: the vehicle hovers where the last trajectory ended
        assert_safe(plan.trajectory, room)
        if plan.reaches_end:
            np.testing.assert_allclose(plan.trajectory.end_m, target, atol=1e-6)
            return
        flown, now_s = plan.trajectory, plan.trajectory.start_s + 1.0
        arc_m = plan.guide.project(flown.at(now_s).position_m, plan.arc_m, 5.0)
        plan = planner.plan(PlanRequest(number, flown.at(now_s), now_s, plan.guide, arc_m, flown))
    raise AssertionError("still on its way after a minute")
