"""Local problems to test with, and what they mean in plain numpy."""

import numpy as np
import numpy.typing as npt

from companion.planner.evaluation import DEVIATION_WEIGHT, SMOOTHNESS_WEIGHT, LocalProblem
from companion.planner.guide import lay_guide
from companion.planner.limits import FlightLimits, Surroundings, flight_limits, surroundings
from companion.planner.local_plan import Horizon, LocalPlanner, pose, reference_within
from companion.planner.mopso import search_plan
from companion.planner.planner import Planner
from companion.planner.reference import SPEED_CAP, TANGENT, WIDTH, Way
from companion.planner.spline_shape import SAMPLES_PER_SEGMENT, spline_shape
from companion.settings import Reserve, SearchSettings
from missions import obstacles
from missions.mission import Mission, load_mission
from missions.mission_items import Track
from missions.trajectory import Trajectory

Array = npt.NDArray[np.float64]

INDOOR = load_mission("indoor")
TERRAIN = load_mission("terrain-1-5uav")
WEIGHTS = np.array([1.0 / 3.0, 0.5, 1.0 / 6.0])
AROUND_THE_CRATE_M = np.array(
    [
        [1, 6.5, 1.5],
        [4, 5.6, 1.5],
        [6, 4.6, 1.5],
        [8, 4.5, 1.5],
        [10, 5.4, 1.5],
        [13, 5.8, 1.5],
        [16, 7, 1.5],
        [19, 8.5, 1.5],
    ]
)


def make_planner(mission: Mission = INDOOR, search: SearchSettings | None = None, seed: int = 0) -> Planner:
    """A planner for the first vehicle of a mission."""
    zones_m = np.array([mission.start_m(mission.vehicles[0]), mission.targets[0].position_m])
    return Planner(mission, Reserve(), search or SearchSettings(), np.random.default_rng(seed), zones_m)


def limits_and_surroundings(mission: Mission = INDOOR) -> tuple[FlightLimits, Surroundings]:
    zones_m = np.array([mission.start_m(mission.vehicles[0]), mission.targets[0].position_m])
    packed = obstacles.pack(mission.world.as_known())
    return flight_limits(mission, Reserve()), surroundings(mission, packed, zones_m)


def local_planner(n_control: int = 12, settings: SearchSettings | None = None) -> LocalPlanner:
    limits, _ = limits_and_surroundings()
    horizon = Horizon(INDOOR.onboard.horizon_m, 5.5)
    return LocalPlanner(limits, horizon, spline_shape(n_control), search_plan(settings or SearchSettings(), WEIGHTS))


def way_of(points_m: Array, speed_m_s: float = 3.0) -> Way:
    limits, _ = limits_and_surroundings()
    track = Track(points_m[1:], np.full(len(points_m) - 1, speed_m_s))
    return lay_guide(track, 0, points_m[0], INDOOR.onboard.horizon_m, limits).way


def problem_of(
    start: Array,
    planner: LocalPlanner | None = None,
    points_m: Array = AROUND_THE_CRATE_M,
    speed_m_s: float = 3.0,
) -> LocalProblem:
    """The problem of planning from a state along a way."""
    planner = planner or local_planner()
    _, around = limits_and_surroundings()
    _, reference = reference_within(1.0, way_of(points_m, speed_m_s), 0.0, start, planner, around)
    return pose(start, reference, planner, around)


def value_in_numpy(x: Array, problem: LocalProblem, mission: Mission = INDOOR) -> tuple[Trajectory, Array]:
    """The trajectory of a candidate and its (5,) value, written down as the documentation has it."""
    limits, samples, around = problem.limits, problem.reference.samples, problem.around
    n_free = len(problem.layout)
    n_segments = n_free + 3
    knot_s = problem.reference.duration_s * np.exp(x[0]) / n_segments
    place, velocity, acceleration = problem.start
    first = np.array(
        [
            place - velocity * knot_s + acceleration * knot_s**2 / 3.0,
            place - acceleration * knot_s**2 / 6.0,
            place + velocity * knot_s + acceleration * knot_s**2 / 3.0,
        ]
    )
    last = np.tile(samples[-1, :3], (3, 1))
    free = problem.fitted_m + problem.layout[:, :6] @ np.vstack((first, last))
    free = free + problem.layout[:, 6:] @ x[1:].reshape(3, n_free).T
    trajectory = Trajectory(np.vstack((first, free, last)), 0.0, knot_s)
    times_s = np.arange(1, n_segments * SAMPLES_PER_SEGMENT + 1) * knot_s / SAMPLES_PER_SEGMENT
    motion = trajectory.sample(times_s)
    speed = np.linalg.norm(motion.velocity_m_s, axis=1)
    hard_m = np.linalg.norm(motion.acceleration_m_s2, axis=1)
    motion_end = np.append(np.ones(len(times_s) - 1), 0.0)  # it rests at the end
    speed, hard_m = speed * motion_end, hard_m * motion_end
    free_m = obstacles.clearance(motion.position_m, around.obstacles)
    lacking_m, scarce_m = lacking_in_numpy(motion.position_m, free_m, problem)
    hard = lacking_m.sum() / limits.clearance_m
    near = free_m < limits.avoidance_distance_m
    allowed = np.minimum(np.where(near, limits.avoidance_m_s, limits.cruise_m_s), samples[1:, SPEED_CAP])
    allowed = np.maximum(allowed, np.linalg.norm(velocity) - limits.braking_m_s2 * times_s)
    hard += np.maximum(speed / allowed - 1.0, 0.0).sum()
    allowed_m_s2 = np.maximum(limits.acceleration_m_s2, np.linalg.norm(acceleration) - limits.jerk_m_s3 * times_s)
    hard += np.maximum(hard_m / allowed_m_s2 - 1.0, 0.0).sum()
    thirds = np.linalg.norm(np.diff(trajectory.control_points_m, n=3, axis=0), axis=1)
    hard += np.maximum(thirds / (limits.jerk_m_s3 * knot_s**3) - 1.0, 0.0).sum()
    soft = climb_and_turn_in_numpy(motion, motion_end, limits) + scarce_m.sum() / limits.clearance_m
    off = motion.position_m - samples[1:, :3]
    along = np.einsum("ij,ij->i", off, samples[1:, TANGENT : TANGENT + 3])
    beside = np.sqrt(np.maximum(np.einsum("ij,ij->i", off, off) - along**2, 0.0))
    soft += np.maximum(beside / samples[1:, WIDTH] - 1.0, 0.0).sum()
    points = np.vstack((place, motion.position_m))
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    length += SMOOTHNESS_WEIGHT * (thirds**2).sum() * n_segments / problem.reference.length_m
    late_s = abs(trajectory.duration_s - problem.reference.duration_s)
    length += late_s * problem.reference.length_m / problem.reference.duration_s
    length += DEVIATION_WEIGHT * (beside**2).mean() / limits.corridor_m
    clearance = -np.minimum(free_m, limits.clearance_cap_m).mean()
    height = np.abs(off[:, 2]).mean()
    return trajectory, np.array([length, clearance, height, hard, soft])


def lacking_in_numpy(points_m: Array, free_m: Array, problem: LocalProblem) -> tuple[Array, Array]:
    """What points lack of clearance, height and flight range [m]; and what lacks of clearance and reserve."""
    limits, around, ends = problem.limits, problem.around, problem.ends
    required_m = np.full(len(points_m), limits.clearance_m)
    height_m = np.full(len(points_m), limits.height_m)
    for *centre_m, radius_m in around.zones_m:
        within = np.linalg.norm(points_m - np.array(centre_m), axis=1) < radius_m
        required_m[within], height_m[within] = limits.contact_m, 0.0
    allowed_m = np.zeros(len(points_m))
    for number, end in enumerate(ends):
        eased_m = 0.5 * np.linalg.norm(points_m - end[:3], axis=1)
        required_m = np.minimum(required_m, end[3] + eased_m)
        height_m = np.minimum(height_m, end[4] + eased_m)
        if number == 0 and end[5] > 2e-6:
            allowed_m = np.maximum(end[5] - eased_m, 0.0)
    ground_m = obstacles.terrain_height(points_m, around.obstacles)
    outside_m = np.maximum(around.room_m[0] - points_m, points_m - around.room_m[1]).max(axis=1)
    lacking_m = (
        np.maximum(required_m - free_m, 0.0)
        + np.maximum(height_m - (points_m[:, 2] - ground_m), 0.0)
        + np.maximum(np.maximum(outside_m, 0.0) - allowed_m, 0.0)
    )
    return lacking_m, np.maximum(required_m + limits.reserve_m - free_m, 0.0)


def climb_and_turn_in_numpy(motion, motion_end: Array, limits: FlightLimits) -> float:
    """The soft violations of climb angle and turn radius."""
    velocity = motion.velocity_m_s * motion_end[:, None]
    acceleration = motion.acceleration_m_s2 * motion_end[:, None]
    level = np.linalg.norm(velocity[:, :2], axis=1)
    soft = np.maximum(np.abs(velocity[:, 2]) - 0.3 - limits.climb_tangent * level, 0.0).sum() / limits.cruise_m_s
    speed = np.linalg.norm(velocity, axis=1)
    fast = speed > 0.5 * limits.avoidance_m_s
    if limits.turn_radius_m > 0.0 and fast.any():
        v, a = velocity[fast], acceleration[fast]
        across = np.linalg.norm(np.cross(v, a), axis=1) / speed[fast]
        allowed = 0.1 * limits.acceleration_m_s2 + speed[fast] ** 2 / limits.turn_radius_m
        soft += np.maximum(across - allowed, 0.0).sum() / limits.acceleration_m_s2
    return float(soft)
