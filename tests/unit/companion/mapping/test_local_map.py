"""What the map promises: hits occupy, what is seen through is free again, the unknown is free; and how far it is."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from companion.mapping.distance_field import GROWN_VOXELS, SATURATED, distance_at
from companion.mapping.local_map import LocalMap
from companion.mapping.occupancy import NODES
from companion.mapping.sorting import Known
from companion.sensing.scan import Scan
from missions import obstacles
from missions.obstacles import FAR_M
from missions.world import Bounds, Box, World

ROOM = World(
    bounds=Bounds(east_m=(0, 12), north_m=(0, 8), up_m=(0, 4)),
    boxes=(Box(name="known", centre_m=(10, 6, 1), half_m=(0.5, 0.5, 1)),),
)
NOBODY = np.zeros((0, 4))
EYE_M = np.array([2.0, 4.0, 1.5])
REACH_M = 1.25


def new_map(world: World = ROOM) -> LocalMap:
    room_m = np.array([world.bounds.low_enu_m, world.bounds.high_enu_m])
    return LocalMap(Known(obstacles.pack(world), room_m, 0.2, 0.6), 0.1, 1.2, 0.2)


def scan(points_m, time_s: float = 0.0, eye_m=EYE_M) -> Scan:
    return Scan(time_s, np.asarray(eye_m, dtype=float), np.asarray(points_m, dtype=float).reshape(-1, 3), 5.0)


def wall(east_m: float, half_m: float = 2.0) -> np.ndarray:
    north, up = np.meshgrid(np.arange(4.05 - half_m, 4.0 + half_m, 0.1), np.arange(0.55, 2.6, 0.1))
    return np.column_stack((np.full(north.size, east_m), north.ravel(), up.ravel()))


def free_m(map_: LocalMap, place_m) -> float:
    return distance_at(*(float(x) for x in place_m), map_.view.field)


def settle(map_: LocalMap, points_m, scans: int, first_s: float = 0.0) -> None:
    for number in range(scans):
        map_.observe(scan(points_m, first_s + 0.1 * number), NOBODY)


def test_before_the_first_scan_everything_is_free():
    assert free_m(new_map(), EYE_M) == FAR_M


def test_one_hit_occupies_and_the_unknown_is_free():
    map_ = new_map()
    map_.observe(scan([[5.05, 4.05, 1.55]]), NOBODY)
    assert free_m(map_, [4.05, 4.05, 1.55]) == pytest.approx(1.0, abs=0.03)
    assert free_m(map_, [5.05, 4.05, 2.05]) == pytest.approx(0.5, abs=0.06)
    assert free_m(map_, [7.0, 4.0, 1.5]) == FAR_M


def test_what_is_seen_through_is_free_again_but_an_old_wall_takes_longer():
    map_ = new_map()
    post = wall(4.05, 0.5)[5::10]
    behind = EYE_M + 2.0 * (post - EYE_M)
    map_.observe(scan(post), NOBODY)
    settle(map_, behind, 12, 0.1)
    assert free_m(map_, [4.05, 4.0, 1.5]) > 1.0
    old = new_map()
    settle(old, post, 8)
    settle(old, behind, 6, 1.0)
    assert free_m(old, [4.05, 4.0, 1.5]) < 0.15
    settle(old, behind, 30, 2.0)
    assert free_m(old, [4.05, 4.0, 1.5]) > 1.0


def test_a_wall_seen_with_noise_stays_and_leaves_no_ghosts_before_it():
    map_, rng = new_map(), np.random.default_rng(0)
    for number in range(30):
        points_m = wall(5.05)[rng.random(len(wall(5.05))) > 0.4]
        map_.observe(scan(points_m + rng.normal(0.0, 0.02, points_m.shape), 0.1 * number), NOBODY)
    for north_m in np.arange(2.5, 5.5, 0.25):
        assert free_m(map_, [4.25, north_m, 1.5]) == pytest.approx(0.75, abs=0.12)
        assert free_m(map_, [5.0, north_m, 1.5]) < 0.15


def test_the_field_holds_exactly_the_distances_to_the_occupied_voxels():
    map_, rng = new_map(), np.random.default_rng(1)
    for number in range(12):
        map_.observe(scan(rng.uniform([0.5, 0.5, 0.5], [11.5, 7.5, 3.5], (200, 3)), 0.1 * number), NOBODY)
    settle(map_, np.empty((0, 3)), 60, 2.0)  # nothing new: all that is stale is written anew
    grid = map_._grid
    assert not grid.stale.any()
    at = np.argwhere(grid.strength > 0) * 4 + 2
    centres = np.zeros(np.array(grid.strength.shape) * 4 + 1, dtype=bool)
    centres[tuple(at.T)] = True
    nodes = (slice(0, -1, 8),) * 3
    window = (slice(0, 8 * 3 * NODES + 1),) * 3
    exact = np.maximum(distance_transform_edt(~centres[window])[nodes] * 0.025 - GROWN_VOXELS * 0.1, 0.0)
    values = grid.field[: 3 * NODES, : 3 * NODES, : 3 * NODES].astype(float) * grid.step_m
    inner = (slice(0, 2 * NODES),) * 3  # farther in, what lies outside of the window does not matter
    near = exact[inner] < REACH_M - 1e-6
    assert near.sum() > 500
    np.testing.assert_allclose(values[inner][near], exact[inner][near], atol=grid.step_m + 1e-6)
    assert np.all(grid.field[inner][~near] == SATURATED)


def test_known_obstacles_the_ground_other_vehicles_and_itself_are_not_mapped():
    map_ = new_map()
    points_m = [[10.0, 5.5, 1.0], [3.0, 3.0, 0.1], EYE_M + [0.1, 0.1, 0.0], [4.0, 4.2, 1.5], [5.0, 12.0, 1.5]]
    map_.observe(scan(points_m), np.array([[4.0, 4.0, 1.5, 0.25]]))
    assert not np.any(map_._grid.strength > 0)


def test_the_map_moves_along_and_remembers_what_is_still_inside():
    plain = World(bounds=Bounds(east_m=(0, 400), north_m=(0, 50), up_m=(0, 4)))
    map_ = new_map(plain)
    east_m, mapped = 20.0, [25.05, 20.05, 1.55]
    map_.observe(scan([mapped], 0.0, [east_m, 20.0, 1.5]), NOBODY)
    for number in range(1, 9):
        map_.observe(scan(np.empty((0, 3)), 0.1 * number, [east_m + number, 20.0, 1.5]), NOBODY)
        assert free_m(map_, mapped) < 0.2
    for number in range(9, 60):
        map_.observe(scan(np.empty((0, 3)), 0.1 * number, [east_m + number, 20.0, 1.5]), NOBODY)
    assert free_m(map_, mapped) == FAR_M
    map_.observe(scan([[83.05, 20.05, 1.55]], 9.0, [80.0, 20.0, 1.5]), NOBODY)
    assert free_m(map_, [82.55, 20.05, 1.55]) == pytest.approx(0.5, abs=0.06)


def test_a_view_that_was_taken_never_changes():
    map_ = new_map()
    map_.observe(scan([[5.05, 4.05, 1.55]]), NOBODY)
    view = map_.view
    before = view.field.values.copy()
    settle(map_, wall(4.05), 3, 1.0)
    np.testing.assert_array_equal(view.field.values, before)
    assert map_.view is not view


def test_what_is_told_to_others_was_hit_by_more_than_one_scan_and_is_on_no_map():
    map_ = new_map()
    map_.observe(scan([[5.05, 4.05, 1.55], [9.5, 6.0, 1.0]]), NOBODY)
    assert len(map_.certain()[0]) == 0
    map_.observe(scan([[5.05, 4.05, 1.55], [9.5, 6.0, 1.0]], 0.1), NOBODY)
    places_m, low_m, high_m = map_.certain()
    np.testing.assert_allclose(places_m, [[5.05, 4.05, 1.55]], atol=1e-9)
    assert np.all(low_m < 0.0)
    assert np.all(high_m > [12.0, 8.0, 4.0])
