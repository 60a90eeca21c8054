"""What moves is found, with its velocity, and does not stay in the map; what stands is never taken for a mover."""

import numpy as np
import pytest

from companion.mapping.distance_field import distance_at
from companion.mapping.local_map import LocalMap
from companion.mapping.sorting import Known
from companion.sensing.scan import Scan
from missions import obstacles
from missions.mission import RangeSensor
from missions.world import Bounds, Cylinder, World
from sitl.sensors.lidar import ray_grid
from sitl.sensors.ray_casting import cast_rays

ROOM = World(bounds=Bounds(east_m=(0, 20), north_m=(0, 15), up_m=(0, 4)))
SENSOR = RangeSensor()
NOBODY = np.zeros((0, 4))


def look(world: World, eye_m: np.ndarray, balls: np.ndarray, time_s: float, rng: np.random.Generator) -> Scan:
    """What a level lidar sees of a world and of (k, 4) balls."""
    rays = np.ascontiguousarray(ray_grid(SENSOR, rng.random(2)))
    packed = obstacles.pack(world, with_threats=False)
    distances_m = cast_rays(eye_m, rays, packed, balls, SENSOR.range_m) + rng.normal(0.0, 0.02, len(rays))
    hit = np.isfinite(distances_m)
    return Scan(time_s, eye_m, eye_m + rays[hit] * distances_m[hit, None], SENSOR.range_m)


def empty_map() -> LocalMap:
    room_m = np.array([ROOM.bounds.low_enu_m, ROOM.bounds.high_enu_m])
    return LocalMap(Known(obstacles.pack(ROOM), room_m, 0.2, 0.6), 0.1, 1.0, 0.2)


@pytest.mark.parametrize("speed_m_s", [0.5, 1.0, 1.5])
def test_a_ball_that_crosses_is_a_mover_with_about_its_velocity_and_leaves_no_trace(speed_m_s: float):
    map_, rng, eye_m = empty_map(), np.random.default_rng(0), np.array([5.0, 7.0, 1.5])
    for number in range(25):
        time_s = 0.1 * number
        centre_m = np.array([8.0, 6.0 + speed_m_s * time_s, 1.5])
        map_.observe(look(ROOM, eye_m, np.array([[*centre_m, 0.3]]), time_s, rng), NOBODY)
    (mover,) = map_.view.movers
    np.testing.assert_allclose(mover.centre_m, centre_m, atol=0.2)
    np.testing.assert_allclose(mover.velocity_m_s, [0.0, speed_m_s, 0.0], atol=0.4)
    assert 0.2 < mover.radius_m < 0.55
    assert distance_at(8.0, 6.0, 1.5, map_.view.field) > 0.5, "where it was at first"


def test_columns_are_no_movers_for_a_vehicle_that_passes_them_closely():
    columns = World(
        bounds=ROOM.bounds,
        cylinders=tuple(
            Cylinder(name=f"c{i}", centre_m=(4.0 + 2.0 * i, 7.0 + side), radius_m=0.25, top_m=3.0, known=False)
            for i, side in enumerate((0.7, -0.7, 0.8, -0.9, 0.7))
        ),
    )
    map_, rng = empty_map(), np.random.default_rng(1)
    for number in range(50):
        time_s = 0.1 * number
        eye_m = np.array([1.0 + 2.8 * time_s, 7.0, 1.5])
        map_.observe(look(columns, eye_m, NOBODY, time_s, rng), NOBODY)
        assert map_.view.movers == ()
