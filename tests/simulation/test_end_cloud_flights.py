"""Whole flights as the paper has them, in process: cloud track points, flown by companions in OFFBOARD."""

import msgspec
import numpy as np
import pytest

from gcs.dialect import Mode
from gcs.fleet.vehicle_state import LandedState
from gcs.settings import PlanningMode
from missions import obstacles
from missions.faults import CompanionKill
from missions.mission import LinkSettings, OnArrival, load_mission
from tests.simulation.whole_system import WholeSystem
from tests.unit.gcs.planner.worlds import round_trip

INDOOR = load_mission("indoor")


def assert_flown_as_the_mission_wants(system: WholeSystem) -> None:
    """The promises of the mission, by the simulator's truth."""
    limits, solid = INDOOR.limits, obstacles.pack(system.mission.world)
    for flown in system.flown().values():
        moved = flown.in_flight()
        speed_m_s = np.linalg.norm(moved.velocities_m_s, axis=1)
        clearance_m = obstacles.clearance(moved.positions_m, solid)
        assert clearance_m.min() >= 0.3
        assert speed_m_s.max() <= limits.cruise_speed_m_s
        assert speed_m_s[clearance_m < limits.avoidance_distance_m].max(initial=0.0) <= 1.2


@pytest.mark.parametrize("seed", range(4))
def test_the_papers_flight_keeps_clearance_separation_and_speeds(seed: int):
    system = WholeSystem(INDOOR, seed=seed)
    report = system.fly()
    assert report.success, report.reason
    assert report.min_separation_m is not None
    assert report.min_separation_m >= 0.6
    for vehicle in report.vehicles:
        assert vehicle.target_error_m <= 0.5
        assert vehicle.tracking_error_m_p99 <= 0.25
        assert vehicle.onboard_replans > 3
    assert_flown_as_the_mission_wants(system)


def test_one_seed_is_one_flight_to_the_bit():
    one, other = WholeSystem(INDOOR, seed=7), WholeSystem(INDOOR, seed=7)
    assert one.fly() == other.fly()
    np.testing.assert_array_equal(one.flown()[2].positions_m, other.flown()[2].positions_m)


@pytest.mark.parametrize("seed", range(2))
def test_the_companions_alone_find_their_way(seed: int):
    alone = msgspec.structs.replace(INDOOR, vehicles=INDOOR.vehicles[:1], allocation={"alpha": "north-east"})
    system = WholeSystem(msgspec.structs.replace(alone, targets=INDOOR.targets[:1]), PlanningMode.ONBOARD, seed=seed)
    report = system.fly()
    assert report.success, report.reason
    assert_flown_as_the_mission_wants(system)


@pytest.mark.parametrize(
    ("mode", "at_s"), [*((PlanningMode.END_CLOUD, s) for s in (0.5, 2.0, 3.5, 5.0, 6.5)), (PlanningMode.ONBOARD, 3.5)]
)
def test_when_a_companion_dies_its_vehicle_holds_and_the_other_goes_on(mode: PlanningMode, at_s: float):
    system = WholeSystem(INDOOR, mode, seed=3, faults=(CompanionKill(vehicle=1, at_s=at_s),))
    report = system.fly()
    alpha, bravo = report.vehicles
    assert not report.success
    assert bravo.reached
    assert not alpha.reached
    assert "the companion fell silent" in report.reason
    assert "alpha" in report.reason
    assert held_within_s(system, 1) <= 2.5
    assert height_lost_m(system, 1) <= 0.5


def held_within_s(system: WholeSystem, sysid: int) -> float:
    """Simulated time from the companion's death to Hold or Land."""
    died_s = system.deaths[sysid]
    return next(at_s - died_s for at_s, mode in system.modes[sysid] if at_s > died_s and mode in {Mode.HOLD, Mode.LAND})


def height_lost_m(system: WholeSystem, sysid: int) -> float:
    flown, died_s = system.flown()[sysid], system.deaths[sysid]
    window = (flown.times_s >= died_s) & (flown.times_s <= died_s + held_within_s(system, sysid))
    heights_m = flown.positions_m[window, 2]
    return float(heights_m[0] - heights_m.min())


@pytest.mark.parametrize("seed", range(2))
def test_a_bad_ground_link_changes_nothing_in_the_air(seed: int):
    link = LinkSettings(loss=0.2, delay_s=0.1, jitter_s=0.1)
    bad = msgspec.structs.replace(INDOOR, simulation=msgspec.structs.replace(INDOOR.simulation, ground_link=link))
    system = WholeSystem(bad, seed=seed)
    report = system.fly()
    assert report.success, report.reason
    assert_flown_as_the_mission_wants(system)


def test_a_ground_link_cut_in_mid_flight_does_not_stop_the_companions():
    system = WholeSystem(load_mission("indoor-link-loss"), seed=2)
    report = system.fly()
    assert report.success, report.reason
    assert all(vehicle.offboard_losses == 0 for vehicle in report.vehicles)


def test_where_the_mission_says_hold_vehicles_end_holding_at_their_targets():
    system = WholeSystem(msgspec.structs.replace(INDOOR, on_arrival=OnArrival.HOLD))
    report = system.fly()
    assert report.success, report.reason
    for vehicle in report.vehicles:
        state = system.station.vehicle(vehicle.sysid)
        assert (state.mode, state.landed, vehicle.landed) == (Mode.HOLD, LandedState.IN_AIR, False)
        assert vehicle.target_error_m < 0.5


def passes_in_order(system: WholeSystem) -> dict[str, list[str]]:
    """For each vehicle the targets that it really came near to, in time."""
    passed: dict[str, list[str]] = {}
    for vehicle in system.mission.vehicles:
        flown = system.flown()[vehicle.sysid].in_flight()
        near = {}
        for target in system.mission.targets:
            off_m = np.linalg.norm(flown.positions_m - np.array(target.position_m), axis=1)
            if off_m.min() <= system.mission.site.arrival_tolerance_m:
                near[target.name] = int(np.argmin(off_m))
        passed[vehicle.name] = sorted(near, key=near.__getitem__)
    return passed


@pytest.mark.parametrize("mode", [PlanningMode.END_CLOUD, PlanningMode.CLOUD, PlanningMode.ONBOARD])
def test_a_route_of_several_targets_is_flown_as_one_mission(mode: PlanningMode):
    system = WholeSystem(round_trip(), mode, seed=1)
    report = system.fly()
    assert report.success, report.reason
    assert passes_in_order(system) == {"alpha": ["south", "south-east"], "bravo": ["north", "north-east"]}


def test_a_vehicle_that_gets_no_target_is_left_on_its_pad():
    alone = msgspec.structs.replace(INDOOR, allocation={"alpha": "north-east", "bravo": ()})
    system = WholeSystem(alone)
    report = system.fly()
    assert report.success, report.reason
    assert [vehicle.name for vehicle in report.vehicles] == ["alpha"]
    assert np.ptp(system.flown()[2].positions_m, axis=0).max() < 0.1


def test_a_companion_with_another_mission_file_is_not_started():
    system = WholeSystem(INDOOR)
    system.companion_missions[2] = load_mission("indoor-unmapped")
    report = system.fly()
    assert "bravo: its companion has read another mission file" in report.reason
    assert not any(state.armed for state in system.station.fleet.vehicles.values())
