"""Whole flights in cloud mode, in process: the autopilots fly the uploaded missions themselves."""

import msgspec
import numpy as np
import pytest

from gcs.settings import PlanningMode
from missions.mission import LinkSettings, Mission, load_mission
from missions.world import World
from tests.simulation.whole_system import WholeSystem

INDOOR = load_mission("indoor")


def fly_by_cloud(mission: Mission, seed: int = 0) -> WholeSystem:
    return WholeSystem(mission, PlanningMode.CLOUD, seed=seed)


def on_a_bad_link(mission: Mission, **link: float) -> Mission:
    simulation = msgspec.structs.replace(mission.simulation, ground_link=LinkSettings(**link))
    return msgspec.structs.replace(mission, simulation=simulation)


@pytest.mark.parametrize("seed", range(3))
def test_both_drones_cross_the_room_and_land_at_their_targets(seed: int):
    report = fly_by_cloud(INDOOR, seed=seed).fly()
    assert report.success, report.reason
    for vehicle in report.vehicles:
        assert vehicle.landed
        assert vehicle.target_error_m < 0.5
        assert vehicle.min_clearance_m > 0.3
        assert vehicle.link.lost == 0
    assert report.min_separation_m is not None
    assert report.min_separation_m > 0.6


def test_autopilots_that_overshoot_the_speed_that_they_are_ordered_keep_the_missions_limit():
    """Along a straight way that is long enough to get up to speed; ordered all of the limit, they flew 3.1 m/s."""
    system = fly_by_cloud(msgspec.structs.replace(INDOOR, world=World(bounds=INDOOR.world.bounds)))
    system.fly()
    for flown in system.flown().values():
        fastest_m_s = np.linalg.norm(flown.velocities_m_s, axis=1).max()
        assert 0.9 * INDOOR.limits.cruise_speed_m_s < fastest_m_s <= INDOOR.limits.cruise_speed_m_s


def test_one_seed_is_one_flight_to_the_bit():
    one, other = fly_by_cloud(INDOOR, seed=4), fly_by_cloud(INDOOR, seed=4)
    assert one.fly() == other.fly()
    np.testing.assert_array_equal(one.flown()[1].positions_m, other.flown()[1].positions_m)
    assert [event.text for event in one.events.events] == [event.text for event in other.events.events]


@pytest.mark.parametrize("seed", range(3))
def test_a_bad_link_delays_a_flight_and_changes_nothing_else(seed: int):
    report = fly_by_cloud(on_a_bad_link(INDOOR, loss=0.15, delay_s=0.1, jitter_s=0.05), seed=seed).fly()
    assert report.success, report.reason
    assert sum(vehicle.link.lost for vehicle in report.vehicles) > 0


def test_a_link_cut_in_mid_flight_does_not_end_it():
    report = fly_by_cloud(load_mission("indoor-link-loss"), seed=1).fly()
    assert report.success, report.reason


def test_a_vehicle_that_stands_elsewhere_is_not_armed():
    elsewhere = fly_by_cloud(INDOOR)
    moved = msgspec.structs.replace(INDOOR.vehicles[1], pad_m=(1.0, 10.5, 0.0))
    elsewhere.mission = msgspec.structs.replace(INDOOR, vehicles=(INDOOR.vehicles[0], moved))
    report = elsewhere.fly()
    assert not report.success
    assert "bravo (vehicle 2): stands 2.0 m from its pad" in report.reason
    assert not any(state.armed for state in elsewhere.station.fleet.vehicles.values())


def test_without_the_missions_consent_no_parameter_is_touched():
    report = fly_by_cloud(msgspec.structs.replace(INDOOR, set_parameters=False)).fly()
    assert not report.success
    assert "COM_OBL_RC_ACT is 0, expected 5" in report.reason
    assert "set_parameters: true" in report.reason
