"""Flights past what no map shows, in process: the companions have nothing but their sensors to find it."""

import functools

import msgspec
import numpy as np
import pytest

from companion.planner.planner import Planner
from missions import obstacles
from missions.mission import Mission, SensorKind, load_mission
from missions.world import Cylinder
from sitl.dynamics.contact import Crash
from tests.simulation.whole_system import WholeSystem, planned

INDOOR = load_mission("indoor")
UNMAPPED = load_mission("indoor-unmapped")


def clearance_m(system: WholeSystem) -> float:
    """The least distance of a vehicle's centre to anything solid, mapped or not, by the simulator's truth."""
    solid = obstacles.pack(system.mission.world)
    flown = [part.in_flight().positions_m for part in system.flown().values()]
    return float(min(obstacles.clearance(positions_m, solid).min() for positions_m in flown))


def test_the_clouds_plan_leads_straight_through_what_is_not_on_the_map():
    """Otherwise the flights below would say nothing."""
    plan = planned(msgspec.json.encode(UNMAPPED), 0)
    solid = obstacles.pack(UNMAPPED.world)
    for vehicle in plan.vehicles:
        assert obstacles.clearance(vehicle.curve_m, solid).min() < 0.0


@functools.cache
def flown_blind() -> WholeSystem:
    system = WholeSystem(UNMAPPED, sensor=SensorKind.NONE)
    system.fly()
    return system


def test_without_a_sensor_both_hit_it():
    assert {collision.sysid for collision in flown_blind().simulator.collisions} == {1, 2}
    assert {collision.what for collision in flown_blind().simulator.collisions} == {Crash.OBSTACLE}


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.slow)])
def test_with_a_lidar_both_find_their_way_around_it(seed: int):
    system = WholeSystem(UNMAPPED, seed=seed)
    report = system.fly()
    assert report.success, report.reason
    assert not system.simulator.collisions
    assert clearance_m(system) >= UNMAPPED.limits.body_radius_m + 0.1


def moved_pillar(east_m: float, north_m: float) -> Mission:
    """The same flight, and the unmapped pillar somewhere else."""
    known = tuple(one for one in UNMAPPED.world.cylinders if one.known)
    pillar = Cylinder(name="pillar", centre_m=(east_m, north_m), radius_m=0.6, top_m=4.0, known=False)
    return msgspec.structs.replace(UNMAPPED, world=msgspec.structs.replace(UNMAPPED.world, cylinders=(*known, pillar)))


@pytest.mark.slow
@pytest.mark.parametrize(("east_m", "north_m"), [(9.5, 10.0), (12.0, 10.5), (15.0, 9.6)])
def test_wherever_it_stands_across_the_way_it_is_found(east_m: float, north_m: float):
    system = WholeSystem(moved_pillar(east_m, north_m), seed=1)
    report = system.fly()
    assert report.success, report.reason
    assert clearance_m(system) >= UNMAPPED.limits.body_radius_m + 0.1


@pytest.mark.slow
def test_a_ring_of_distances_is_enough_to_find_it():
    system = WholeSystem(UNMAPPED, seed=1, sensor=SensorKind.OBSTACLE_DISTANCE)
    report = system.fly()
    assert report.success, report.reason
    assert not system.simulator.collisions


def test_scans_lie_on_what_is_there(monkeypatch: pytest.MonkeyPatch):
    """Pose, frame and mounting together: points are on the true surfaces, within noise."""
    seen: list[np.ndarray] = []
    monkeypatch.setattr(Planner, "observe", lambda self, scan, others: seen.append(scan.points_enu_m))
    alone = msgspec.structs.replace(INDOOR, vehicles=INDOOR.vehicles[:1], targets=INDOOR.targets[:1], allocation=None)
    system = WholeSystem(alone, seed=3)
    assert system.fly().success
    points = np.concatenate(seen)
    solid = obstacles.pack(system.mission.world)
    off_m = np.minimum(np.abs(obstacles.clearance(points, solid)), np.abs(points[:, 2]))
    assert len(points) > 50_000
    assert np.percentile(off_m, 50) < 0.04
    assert np.percentile(off_m, 95) < 0.15
