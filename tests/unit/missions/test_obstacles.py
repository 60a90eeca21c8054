"""Clearance and terrain: compiled functions against plain numpy."""

import numpy as np
import numpy.typing as npt
import pytest

from missions.obstacles import FAR_M, Obstacles, clearance, clearance_at, pack, terrain_height, terrain_height_at
from missions.world import Bounds, Box, Cylinder, Peak, Threat, World

Array = npt.NDArray[np.float64]

BOUNDS = Bounds(east_m=(0, 200), north_m=(0, 200), up_m=(0, 200))
WORLD = World(
    bounds=BOUNDS,
    boxes=(Box(name="box", centre_m=(50, 50, 10), half_m=(5, 8, 10)),),
    cylinders=(Cylinder(name="post", centre_m=(120, 40), radius_m=6, base_m=2, top_m=30),),
    threats=(Threat(name="radar", centre_m=(60, 140), radius_m=30),),
    peaks=(
        Peak(name="hill", centre_m=(150, 140), radius_m=25),
        Peak(name="flat", centre_m=(30, 180), radius_m=20, height_m=6),
    ),
)


def brute_force(points_m: Array, world: World) -> Array:
    """Signed distances from dense samples of every surface; good to about 1e-3 m."""
    return np.array([min(_to_each(point, world)) for point in points_m])


def _to_each(p: Array, world: World) -> list[float]:
    distances = []
    for box in world.boxes:
        q = np.abs(p - box.centre_m) - box.half_m
        distances.append(float(np.linalg.norm(np.maximum(q, 0)) + min(q.max(), 0)))
    for post in world.cylinders:
        q = np.array([np.hypot(*(p[:2] - post.centre_m)) - post.radius_m, max(post.base_m - p[2], p[2] - post.top_m)])
        distances.append(float(np.linalg.norm(np.maximum(q, 0)) + min(q.max(), 0)))
    for threat in world.threats:
        distances.append(float(np.linalg.norm(p - [*threat.centre_m, 0.0]) - threat.radius_m))
    for peak in world.peaks:
        radius = np.hypot(*(p[:2] - peak.centre_m))
        u = np.linspace(0.0, peak.radius_m, 20001)
        z = peak.top_m * np.exp(-((u / peak.slope_m) ** 2))
        nearest = float(np.sqrt(((u - radius) ** 2 + (z - p[2]) ** 2).min()))
        inside = radius < peak.radius_m and p[2] < peak.top_m * np.exp(-((radius / peak.slope_m) ** 2))
        distances.append(-nearest if inside else nearest)
    return distances


def points(n: int, seed: int) -> Array:
    rng = np.random.default_rng(seed)
    around_things = rng.normal([150, 140, 30], [15, 15, 25], (n // 2, 3))
    everywhere = rng.uniform([0, 0, 0], [200, 200, 120], (n - n // 2, 3))
    both = np.concatenate((around_things, everywhere))
    both[:, 2] = np.abs(both[:, 2])
    return both


@pytest.mark.parametrize("seed", [1, 2])
def test_compiled_clearance_equals_distances_to_densely_sampled_surfaces(seed: int):
    sample = points(300, seed)
    np.testing.assert_allclose(clearance(sample, pack(WORLD)), brute_force(sample, WORLD), atol=2e-3)


def test_of_two_nearly_equal_ways_to_a_high_peak_the_shorter_one_counts():
    """From above a flank the way down to it may be as long as the way across to it."""
    world = World(bounds=BOUNDS, peaks=(Peak(name="high", centre_m=(0, 0), radius_m=200),))
    sample = np.random.default_rng(4).uniform([0, 0, 0], [260, 0.1, 700], (600, 3))
    np.testing.assert_allclose(clearance(sample, pack(world)), brute_force(sample, world), atol=0.05)


def test_clearance_is_negative_inside_and_zero_on_the_surface():
    solid = pack(WORLD)
    inside_surface_outside = np.array([[50, 50, 10], [55, 50, 10], [60, 50, 10]], dtype=float)
    np.testing.assert_allclose(clearance(inside_surface_outside, solid), [-5, 0, 5], atol=1e-9)


def test_flat_ground_is_no_obstacle():
    assert clearance(np.array([[5.0, 5.0, 0.0]]), pack(WORLD))[0] > 20


def test_an_empty_world_is_clear_everywhere():
    assert clearance(np.zeros((2, 3)), pack(World(bounds=BOUNDS))).tolist() == [FAR_M, FAR_M]


def test_sensors_and_collisions_do_without_threats():
    inside_the_threat = np.array([[60.0, 140.0, 5.0]])
    assert clearance(inside_the_threat, pack(WORLD))[0] < 0
    assert clearance(inside_the_threat, pack(WORLD, with_threats=False))[0] > 0


def test_terrain_is_the_sum_of_the_peaks_and_one_percent_is_left_at_their_feet():
    ground = pack(WORLD)
    assert terrain_height(np.array([150.0, 140.0]), ground) == pytest.approx(62.5, rel=1e-3)
    assert terrain_height(np.array([175.0, 140.0]), ground) == pytest.approx(0.625, rel=1e-3)


def test_the_functions_for_one_point_agree_with_those_for_many():
    sample, solid = points(20, 3), pack(WORLD)
    one_by_one = [clearance_at(*point, solid) for point in sample]
    np.testing.assert_array_equal(one_by_one, clearance(sample, solid))
    heights = [terrain_height_at(point[0], point[1], solid) for point in sample]
    np.testing.assert_allclose(heights, terrain_height(sample, solid), rtol=1e-12)


def test_packed_arrays_keep_their_shapes_when_empty():
    assert [part.shape for part in pack(World(bounds=BOUNDS))] == [(0, 6), (0, 5), (0, 3), (0, 5)]
    assert isinstance(pack(WORLD), Obstacles)
