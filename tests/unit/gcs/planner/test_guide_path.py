"""Ways around what no bent straight line gets past."""

import itertools

import msgspec
import numpy as np
import pytest

from gcs.planner.guide_path import guide_path
from missions import obstacles
from missions.mission import Mission
from tests.unit.gcs.planner.worlds import everything, room, wall

MAZE = wall(5.0, (11.0, 13.5)) + wall(10.0, (1.5, 4.0)) + wall(15.0, (11.0, 13.5))


def path_through(mission: Mission, index: int = 0) -> np.ndarray | None:
    return guide_path(mission, mission.start_m(mission.vehicles[index]), np.array(mission.targets[index].position_m))


def densely(path_m: np.ndarray) -> np.ndarray:
    legs = [np.linspace(a, b, 300) for a, b in itertools.pairwise(path_m)]
    return np.concatenate(legs)


def test_where_nothing_is_in_the_way_it_is_straight():
    path_m = path_through(room())
    assert path_m is not None
    np.testing.assert_allclose(path_m, [[1, 6, 1.5], [19, 6, 1.5]])


def test_it_leads_through_all_gaps_of_a_maze_and_keeps_clear():
    mission = room(MAZE)
    path_m = path_through(mission)
    assert path_m is not None
    points_m = densely(path_m)
    assert obstacles.clearance(points_m, obstacles.pack(mission.world)).min() > 0.6
    norths_m = np.interp([5.0, 10.0, 15.0], points_m[:, 0], points_m[:, 1])
    assert norths_m[0] > 11.0
    assert norths_m[1] < 4.0
    assert norths_m[2] > 11.0


def test_it_climbs_no_steeper_than_vehicles_may():
    """Over a wall of 2 m it would be 8 degrees straight ahead: with 6 allowed, it has to take a longer way up."""
    mission = room(wall(10.0, None), pads_m=((1.0, 6.0, 0.0),), targets_m=((19.0, 6.0, 1.5),), climb_angle_deg=6.0)
    low_wall = msgspec.structs.replace(mission.world.boxes[0], centre_m=(10.0, 7.5, 1.0), half_m=(0.15, 7.5, 1.0))
    world = msgspec.structs.replace(mission.world, boxes=(low_wall,))
    path_m = path_through(msgspec.structs.replace(mission, world=world))
    assert path_m is not None
    steps_m = np.diff(path_m, axis=0)
    climb_deg = np.degrees(np.arctan2(np.abs(steps_m[:, 2]), np.hypot(steps_m[:, 0], steps_m[:, 1])))
    long = np.linalg.norm(steps_m, axis=1) > 0.5  # but for the step from the start to the nearest cell
    assert path_m[:, 2].max() > 2.6
    assert climb_deg[long].max() <= 6.0 + 1e-6


def test_outdoors_it_keeps_clear_of_mountains_threats_and_ground():
    mission = everything(launch_zone_radius_m=0.0)
    high = msgspec.structs.replace(mission, launch_point_m=(0.0, 0.0, 50.0))
    path_m = path_through(high)
    assert path_m is not None
    solid = obstacles.pack(high.world)
    points_m = densely(path_m)[10:-10]
    assert obstacles.clearance(points_m, solid).min() > 9.0
    assert (points_m[:, 2] - obstacles.terrain_height(points_m, solid)).min() > 9.0


@pytest.mark.parametrize("boxes", [wall(10.0, None), wall(10.0, (6.0, 7.0))], ids=["a closed wall", "too narrow a gap"])
def test_where_there_is_no_way_it_says_so(boxes):
    assert path_through(room(boxes)) is None
