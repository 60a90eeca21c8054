"""The simulated range sensor sees what is there, as far as it can, with the errors that the mission gives it."""

import math

import msgspec
import numpy as np
import pytest

from missions import obstacles
from missions.lidar_packets import MOUNT_FLU_M, unpack
from missions.mission import RangeSensor
from missions.world import Box, Cylinder, Mover, Peak, Threat, World
from sitl.dialect import mavlink
from sitl.microservices.outbox import Link
from sitl.open_field import open_field
from sitl.sensors.lidar import RangeSensors, flu_to_enu, ray_grid
from sitl.sensors.ray_casting import cast_rays
from sitl.simulator import Simulator
from tests.unit.sitl.flown import Flown

LEVEL_EAST = np.array([math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)])
"""Heading east: the sensor's axes are ENU's."""
SHARP = RangeSensor(range_m=8.0, noise_m=0.0, dropout=0.0)
SOLID = World(
    bounds=open_field(1).world.bounds,
    boxes=(Box(name="box", centre_m=(4.0, 1.0, 1.0), half_m=(0.5, 1.0, 1.0)),),
    cylinders=(Cylinder(name="column", centre_m=(-3.0, 0.0), radius_m=0.7, top_m=3.0, base_m=0.5, known=False),),
    peaks=(Peak(name="hill", centre_m=(2.0, -6.0), radius_m=5.0, height_m=4.0),),
    threats=(Threat(name="radar", centre_m=(0.0, 3.0), radius_m=2.0),),
)
NO_BALLS = np.zeros((0, 4))


def world_with(**things) -> World:
    return msgspec.structs.replace(open_field(1).world, **things)


def mission_with(world: World, sensor: RangeSensor = SHARP, n_vehicles: int = 1):
    return msgspec.structs.replace(open_field(n_vehicles), world=world, sensor=sensor)


def one_scan(world: World, sensor: RangeSensor = SHARP, position=(0.0, 0.0, 1.5), time_s: float = 0.0):
    sensors = RangeSensors(mission_with(world, sensor), np.random.default_rng(1))
    (scan,) = sensors.scan(time_s, np.array([position]), LEVEL_EAST[None], np.array([time_s]))
    return scan


def random_rays(n: int) -> np.ndarray:
    rays = np.random.default_rng(7).standard_normal((n, 3))
    return rays / np.linalg.norm(rays, axis=1)[:, None]


def marched(origin: np.ndarray, rays: np.ndarray, world: World, balls: np.ndarray, range_m: float) -> np.ndarray:
    """The reference: clearances and heights at every 2 mm of every ray."""
    solid, all_of_it = obstacles.pack(msgspec.structs.replace(world, threats=(), peaks=())), obstacles.pack(world)
    distances = np.arange(0.0, range_m, 2e-3)
    out = np.full(len(rays), np.inf)
    for i, ray in enumerate(rays):
        points = origin + distances[:, None] * ray
        hit = (obstacles.clearance(points, solid) <= 0.0) | (
            points[:, 2] <= obstacles.terrain_height(points, all_of_it)
        )
        for ball in balls:
            hit |= np.linalg.norm(points - ball[:3], axis=1) <= ball[3]
        if hit.any():
            out[i] = distances[np.argmax(hit)]
    return out


def test_compiled_rays_end_where_marched_ones_do():
    origin, rays = np.array([0.2, -0.1, 1.5]), random_rays(300)
    balls = np.array([[0.0, 2.0, 1.5, 0.4], [1.0, -1.0, 3.0, 0.5]])
    found = cast_rays(origin, rays, obstacles.pack(SOLID, with_threats=False), balls, 8.0)
    expected = marched(origin, rays, SOLID, balls, 8.0)
    both = np.isfinite(found) & np.isfinite(expected)
    assert both.sum() > 130
    assert np.sum(np.isfinite(found) != np.isfinite(expected)) <= 1, "a ray may touch something within 2 mm"
    np.testing.assert_allclose(found[both], expected[both], atol=0.01)


def test_rays_along_the_axes_and_from_within():
    packed = obstacles.pack(world_with(boxes=SOLID.boxes))
    axes = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    found = cast_rays(np.array([0.0, 1.0, 1.5]), axes, packed, NO_BALLS, 8.0)
    np.testing.assert_allclose(found, [3.5, np.inf, 1.5, np.inf])
    assert cast_rays(np.array([4.0, 1.0, 1.0]), axes, packed, NO_BALLS, 8.0).tolist() == [0.0] * 4


def test_points_lie_on_surfaces_that_can_be_seen():
    points = one_scan(SOLID).points_flu_m + np.array([0.0, 0.0, 1.5])
    assert len(points) > 300
    solid = obstacles.pack(msgspec.structs.replace(SOLID, threats=(), peaks=()))
    above_ground = points[:, 2] - obstacles.terrain_height(points, obstacles.pack(SOLID))
    assert np.all(np.minimum(np.abs(obstacles.clearance(points, solid)), np.abs(above_ground)) < 0.01)
    assert not np.any((points[:, 0] > 3.6) & (np.abs(points[:, 1] - 1.0) < 0.4) & (points[:, 2] < 1.4)), "behind a wall"


def test_threats_are_not_seen():
    assert len(one_scan(world_with(threats=SOLID.threats), position=(0.0, 0.0, 20.0)).points_flu_m) == 0


def test_the_field_of_view_is_kept():
    camera = RangeSensor(range_m=8.0, horizontal_deg=87.0, vertical_deg=58.0)
    rays = ray_grid(camera, np.array([0.3, 0.9]))
    assert np.degrees(np.abs(np.arctan2(rays[:, 1], rays[:, 0]))).max() <= 43.5
    assert np.degrees(np.abs(np.arcsin(rays[:, 2]))).max() <= 29.0
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1.0)


def test_noise_and_dropouts_are_those_of_the_mission():
    wall = world_with(boxes=(Box(name="wall", centre_m=(5.0, 0.0, 50.0), half_m=(1.0, 99.0, 99.0)),))
    camera = {"range_m": 20.0, "horizontal_deg": 60.0, "vertical_deg": 60.0}
    exact = one_scan(wall, RangeSensor(**camera, noise_m=0.0, dropout=0.0), (0.0, 0.0, 50.0)).points_flu_m
    noisy = one_scan(wall, RangeSensor(**camera, noise_m=0.05, dropout=0.25), (0.0, 0.0, 50.0)).points_flu_m
    assert len(noisy) / len(exact) == pytest.approx(0.75, abs=0.07)
    seen = noisy - MOUNT_FLU_M
    lengths = np.linalg.norm(seen, axis=1)
    errors = lengths - 4.0 * lengths / seen[:, 0]
    assert errors.std() == pytest.approx(0.05, rel=0.2)


def test_a_mover_is_seen_where_it_is_now():
    shuttle = Mover(name="ball", from_m=(4.0, 0.0, 20.0), to_m=(4.0, 8.0, 20.0), radius_m=0.5, speed_m_s=1.0)
    scan = one_scan(world_with(movers=(shuttle,)), position=(4.0, 0.0, 20.0), time_s=3.0)
    assert np.allclose(np.linalg.norm(scan.points_flu_m - [0.0, 3.0, 0.0], axis=1), 0.5, atol=1e-6)
    assert len(scan.points_flu_m) > 10


def test_vehicles_see_each_other_and_not_themselves():
    sensors = RangeSensors(mission_with(world_with(), n_vehicles=2), np.random.default_rng(1))
    positions = np.array([[0.0, 0.0, 20.0], [2.0, 0.0, 20.0]])
    first, second = sensors.scan(0.0, positions, np.array([LEVEL_EAST, LEVEL_EAST]), np.zeros(2))
    assert first.points_flu_m[:, 0].min() > 1.0
    assert second.points_flu_m[:, 0].max() < -1.0


def test_a_sensor_turns_and_tilts_with_its_vehicle():
    ahead = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    np.testing.assert_allclose(flu_to_enu(ahead, LEVEL_EAST), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], atol=1e-12)
    nose_up = np.array([math.cos(math.pi / 8), 0.0, math.sin(math.pi / 8), 0.0])
    np.testing.assert_allclose(flu_to_enu(ahead[:1], nose_up), [[0.0, math.sqrt(0.5), math.sqrt(0.5)]], atol=1e-12)


# ------------------------------------------------------------------ simulator
def wall_ahead() -> Simulator:
    """North of the pad, where a vehicle looks: 3 m off."""
    wall = Box(name="wall", centre_m=(0.0, 4.0, 1.0), half_m=(5.0, 1.0, 3.0))
    return Simulator(mission_with(world_with(boxes=(wall,))), seed=1, lidar=True)


def test_scans_come_at_their_rate_on_the_vehicles_clock():
    simulator, datagrams = wall_ahead(), []
    for _ in range(100):
        simulator.step()
        datagrams += simulator.lidar_datagrams()
    packets = [unpack(datagram) for sysid, datagram in datagrams]
    assert {sysid for sysid, _ in datagrams} == {1}
    assert [packet.number for packet in packets] == list(range(len(packets)))
    times = sorted({packet.time_s for packet in packets})
    np.testing.assert_allclose(times, [0.02, *np.arange(1, 21) * 0.1], atol=1e-9)
    points = np.vstack([packet.points_flu_m for packet in packets])
    ahead = points[(np.abs(points[:, 1]) < 1.0) & (points[:, 0] > 0.0) & (points[:, 2] > 0.2)]
    np.testing.assert_allclose(ahead[:, 0], 3.0, atol=0.05, err_msg="the wall")


def test_without_a_lidar_there_are_no_packets_and_no_distances():
    simulator = Simulator(1, seed=1)
    for _ in range(100):
        simulator.step()
    assert simulator.lidar_datagrams() == []
    assert not [f for _, _, f in simulator.transmissions() if f[7:9] == (330).to_bytes(2, "little")]


def messages(simulator: Simulator, message_id: int, link: Link) -> list:
    parser = mavlink.MAVLink(None)
    frames = [f for _, way, f in simulator.transmissions() if way is link]
    return [m for m in (parser.decode(bytearray(f)) for f in frames) if m.get_msgId() == message_id]


def test_obstacle_distance_tells_the_companion_what_is_around():
    flown = Flown(wall_ahead().mission, lidar=True)
    flown.take_off(2.0)
    found = flown.messages("OBSTACLE_DISTANCE", link=Link.ONBOARD)
    last = found[-1]
    assert last.time_usec - found[-11].time_usec == pytest.approx(1e6, abs=1e5)
    assert (last.increment, last.frame, last.max_distance) == (5, mavlink.MAV_FRAME_BODY_FRD, 800)
    assert last.distances[0] == pytest.approx(300, abs=3)
    assert last.distances[6] == pytest.approx(300 / math.cos(math.radians(30.0)), rel=0.06)
    assert last.distances[36] == 801, "nothing behind"


def test_sectors_out_of_view_are_unknown():
    camera = RangeSensor(range_m=8.0, horizontal_deg=90.0, noise_m=0.0, dropout=0.0)
    distances = one_scan(world_with(), camera, (0.0, 0.0, 20.0)).distances_m
    assert math.isinf(distances[0])
    assert math.isinf(distances[9])
    assert math.isnan(distances[10])
    assert math.isnan(distances[36])


def test_one_seed_is_one_scan():
    one, other = wall_ahead(), wall_ahead()
    for simulator in (one, other):
        for _ in range(30):
            simulator.step()
    assert one.lidar_datagrams() == other.lidar_datagrams()


def test_a_lidar_does_not_change_the_flight():
    seen, blind = wall_ahead(), Simulator(wall_ahead().mission, seed=1)
    for _ in range(100):
        seen.step()
        blind.step()
    np.testing.assert_array_equal(seen.truth.position_enu_m, blind.truth.position_enu_m)


def test_utm_global_position_is_streamed_when_asked_for():
    flown = Flown().run(1.0)
    assert not flown.messages("UTM_GLOBAL_POSITION")
    assert flown.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 340, 2e5) == mavlink.MAV_RESULT_ACCEPTED
    flown.run(2.0)
    assert 10 <= len(flown.messages("UTM_GLOBAL_POSITION")) <= 11
    found = flown.last("UTM_GLOBAL_POSITION")
    assert found.lat == pytest.approx(473977432, abs=20)
    assert found.flight_state == mavlink.UTM_FLIGHT_STATE_GROUND
    assert not found.flags & mavlink.UTM_DATA_AVAIL_FLAGS_NEXT_WAYPOINT_AVAILABLE
    assert found.uas_id[0] == 1
