"""A flight over terrain, in process: long trajectories, slow climbs, positions as good as GNSS has them."""

import msgspec
import numpy as np

from gcs.dialect import Mode
from missions import obstacles
from missions.mission import Target, load_mission
from tests.simulation.whole_system import WholeSystem

TERRAIN = load_mission("terrain-1-5uav")
FAR_M = (110.0, 80.0, 40.0)


def test_one_vehicle_climbs_out_over_the_terrain_and_holds_at_its_target():
    alone = msgspec.structs.replace(
        TERRAIN, vehicles=TERRAIN.vehicles[:1], targets=(Target(name="near", position_m=FAR_M),)
    )
    system = WholeSystem(alone)
    report = system.fly()
    assert report.success, report.reason
    (vehicle,) = report.vehicles
    assert vehicle.offboard_losses == 0
    state = system.station.vehicle(vehicle.sysid)
    assert state.mode is Mode.HOLD
    assert state.companion.trajectory is not None
    (flown,) = system.flown().values()
    assert np.linalg.norm(flown.positions_m[-1] - FAR_M) < TERRAIN.site.arrival_tolerance_m
    moved = flown.in_flight()
    noise_m_s = 3.0 * TERRAIN.simulation.positioning.velocity_std_m_s  # it flies by its estimate, not by the truth
    assert np.linalg.norm(moved.velocities_m_s, axis=1).max() <= TERRAIN.limits.cruise_speed_m_s + noise_m_s
    assert obstacles.clearance(moved.positions_m, obstacles.pack(TERRAIN.world)).min() > 0.0
