"""Telemetry folded into state."""

import math

import numpy as np
import pytest

from gcs.dialect import Mode, mavlink
from gcs.fleet.fleet import Fleet
from gcs.fleet.vehicle_state import LandedState, VehicleState
from missions import tunnel
from missions.mission import load_mission
from missions.occupancy import OccupancyBlock, encode_block
from missions.trajectory import Trajectory
from missions.tunnel import CompanionState, TrajectoryKind, TrajectoryMessage
from tests.unit.gcs import messages as mav


def state_after(*received) -> VehicleState:
    fleet = Fleet()
    fleet.fold(mav.heartbeat(), 0.0)
    for at_s, message in enumerate(received):
        fleet.fold(message, float(at_s))
    return fleet.vehicles[1]


def test_a_vehicle_exists_from_its_autopilots_first_heartbeat():
    fleet = Fleet()
    fleet.fold(mav.position(47.4, 8.5, 490.0), 0.0)
    fleet.fold(mav.companion_heartbeat(), 0.0)
    assert fleet.vehicles == {}
    fleet.fold(mav.heartbeat(sysid=7), 0.0)
    assert list(fleet.vehicles) == [7]


def test_a_heartbeat_tells_mode_arming_and_failsafe():
    state = state_after(mav.heartbeat(Mode.OFFBOARD, armed=True, status=mavlink.MAV_STATE_CRITICAL))
    assert (state.mode, state.armed, state.failsafe) == (Mode.OFFBOARD, True, True)
    assert state_after(mav.from_autopilot(mavlink.MAVLink_heartbeat_message(2, 12, 0, 0x12345678, 3, 3))).mode is (
        Mode.UNKNOWN
    )


def test_a_vehicle_goes_offline_when_its_heartbeats_stop():
    state = state_after(mav.heartbeat())
    assert state.online(1.0)
    assert not state.online(10.0)


def test_position_and_velocity_are_turned_into_enu():
    mission = load_mission("indoor")
    place = mission.frame.geodetic(np.array([3.0, 5.0, 1.5]))
    state = state_after(mav.position(place.latitude_deg, place.longitude_deg, place.altitude_amsl_m, time_s=12.5))
    np.testing.assert_allclose(state.position_m(mission.frame), [3.0, 5.0, 1.5], atol=0.01)
    np.testing.assert_allclose(state.position_m(mission.frame, 0.5), [3.0, 5.0, 1.0], atol=0.01)
    np.testing.assert_allclose(
        state.velocity_enu_m_s, [-2.0, 1.0, -0.5]
    )  # sent: vx (north) 1, vy (east) -2, vz (down) 0.5
    assert state.boot_time_s == 12.5


def test_the_vehicles_clock_goes_on_between_messages_at_the_speed_factor():
    state = state_after(mav.position(47.4, 8.5, 490.0, time_s=10.0))
    assert state.vehicle_time_s(now_s=2.0, speed=5.0) == pytest.approx(20.0)


def test_an_autopilot_without_a_fix_has_no_position():
    assert state_after(mav.position(0.0, 0.0, 0.0)).place is None
    assert state_after().position_m(load_mission("indoor").frame) is None


def test_landing_and_readiness():
    state = state_after(mav.landed(2), mav.system_status(ready=True, battery_percent=71))
    assert (state.landed, state.ready_to_arm, state.battery_percent) == (LandedState.IN_AIR, True, 71.0)
    assert state_after(mav.landed(99)).landed is LandedState.UNDEFINED
    assert math.isnan(state_after(mav.system_status(battery_percent=-1)).battery_percent)


def test_attitudes_that_are_not_finite_change_nothing():
    broken = mav.from_autopilot(mavlink.MAVLink_attitude_quaternion_message(0, math.nan, 0, 0, 0, 0, 0, 0))
    np.testing.assert_array_equal(state_after(broken).attitude_wxyz, [1, 0, 0, 0])
    euler = mav.from_autopilot(mavlink.MAVLink_attitude_message(0, 0.0, 0.0, math.pi / 2, 0, 0, 0))
    np.testing.assert_allclose(state_after(euler).attitude_wxyz, [math.sqrt(0.5), 0, 0, math.sqrt(0.5)])


def test_the_companions_report_is_decoded_and_nonsense_is_counted():
    state = state_after(
        mav.companion_heartbeat(),
        mav.companion_status(CompanionState.FLYING, plan_id=77, replans=3),
        mav.tunnel_message(tunnel.PayloadType.COMPANION_STATUS, b"\x63nonsense"),
        mav.tunnel_message(0x9999, b"somebody else's"),
    )
    assert state.companion.status is not None
    assert (state.companion.status.state, state.companion.status.plan_id) == (CompanionState.FLYING, 77)
    assert state.undecodable == 1
    assert state.companion_online(0.5)


def test_the_companions_trajectory_is_kept_for_the_page():
    flown = Trajectory(np.tile([1.0, 2.0, 1.5], (6, 1)), 1_700_000_000.0, 0.4)
    sent = TrajectoryMessage(kind=TrajectoryKind.COMMITTED, plan_id=1, revision=9, radius_m=0.2, trajectory=flown)
    state = state_after(mav.tunnel_message(tunnel.PayloadType.TRAJECTORY, tunnel.encode_trajectory(sent)))
    assert state.companion.trajectory is not None
    assert state.companion.trajectory_revision == 9


def test_what_the_autopilot_says_is_kept_without_its_tabs():
    state = state_after(mav.status_text("Armed by external command\t", severity=6))
    assert [(text.text, text.severity) for text in state.texts] == [("Armed by external command", 6)]


def test_a_broadcast_of_the_forwarded_gcs_is_no_vehicle():
    fleet = Fleet()
    heartbeat = mav.sent_by(255, 190, mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    fleet.fold(heartbeat, 0.0)
    assert fleet.vehicles == {}


def test_what_companions_have_seen_becomes_one_map_of_the_fleet():
    fleet = Fleet()
    for sysid in (1, 2):
        fleet.fold(mav.heartbeat(sysid=sysid), 0.0)
        occupied = np.zeros((8, 8, 8), np.bool_)
        occupied[sysid, 0, 0] = True
        payload = encode_block(OccupancyBlock((0, 0, 0), 0.2, 1, occupied))
        fleet.fold(mav.tunnel_message(tunnel.PayloadType.OCCUPANCY, payload, sysid), 0.0)
    assert fleet.observed.voxels.tolist() == [[1, 0, 0], [2, 0, 0]]


def test_a_block_that_is_none_is_counted():
    state = state_after(mav.tunnel_message(tunnel.PayloadType.OCCUPANCY, b"\x07" * 20))
    assert state.undecodable == 1
