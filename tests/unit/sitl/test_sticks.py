"""What a pilot with a joystick can do, and what happens when he takes over or goes away."""

import math

import numpy as np
import pytest

from missions.faults import GpsLoss, Weather
from sitl.dialect import mavlink
from sitl.dynamics.airframe import SIH
from tests.unit.sitl.flown import NAN, Flown

ACCEPTED, TEMPORARILY_REJECTED = 0, 1
POSITION, ALTITUDE, STABILIZED, ACRO, MANUAL = (3, 0), (2, 0), (7, 0), (5, 0), (1, 0)


def piloted(mode: tuple[int, int], height_m: float = 10.0, **options) -> Flown:
    """Hovering, sticks centred, in a mode for sticks."""
    flown = Flown(**options).take_off(height_m)
    flown.hold_sticks().run(0.2)
    assert flown.command(176, 1, *mode) == ACCEPTED
    return flown.run(1.0)


# ------------------------------------------------------------------- position
@pytest.mark.parametrize(("pitch", "px4_m_s"), [(500, 1.4), (1000, 7.4)])
def test_the_pitch_stick_flies_as_fast_as_on_px4(pitch, px4_m_s):
    flown = piloted(POSITION, airframe=SIH)
    flown.hold_sticks(pitch=pitch).run(5.0)
    assert flown.velocity[1] == pytest.approx(px4_m_s, rel=0.25)
    assert abs(flown.velocity[0]) < 0.2


def test_the_throttle_stick_climbs_as_fast_as_on_px4():
    flown = piloted(POSITION, airframe=SIH)
    flown.hold_sticks(throttle=1000).run(3.0)
    assert flown.velocity[2] == pytest.approx(2.6, rel=0.15)


def test_sticks_let_go_brake_and_keep_the_place():
    flown = piloted(POSITION)
    flown.hold_sticks(roll=1000).run(3.0)
    assert flown.velocity[0] > 3.0
    flown.hold_sticks().run(6.0)
    there = flown.position.copy()
    assert np.linalg.norm(flown.velocity) < 0.1
    flown.simulator.order(Weather(east_m_s=6.0))
    flown.run(20.0)
    assert np.allclose(flown.position, there, atol=0.3)
    assert flown.height == pytest.approx(10.0, abs=0.3)


def test_sticks_are_relative_to_the_nose():
    flown = piloted(POSITION)
    flown.hold_sticks(yaw=1000).run(1.0)
    flown.hold_sticks().run(2.0)
    yaw_rad = flown.autopilot.snapshot.yaw_rad
    assert abs(yaw_rad) > 0.5
    flown.hold_sticks(pitch=1000).run(3.0)
    east, north = flown.velocity[:2]
    assert math.remainder(math.atan2(east, north) - yaw_rad, 2 * math.pi) == pytest.approx(0.0, abs=0.15)


def test_a_pilot_can_take_off_and_land():
    flown = Flown().boot()
    flown.hold_sticks().run(0.2)
    flown.command(176, 1, *POSITION)
    assert flown.run(1.1).last("HEARTBEAT").system_status == 3
    assert flown.command(400, 1) == ACCEPTED
    flown.run(3.0)
    assert flown.height == pytest.approx(0.0, abs=0.01)
    flown.hold_sticks(throttle=900).run(6.0)
    assert flown.height > 2.0
    flown.hold_sticks(throttle=0)
    flown.until(lambda: not flown.armed, 30.0)
    assert "Disarmed by landing" in flown.texts
    assert not flown.simulator.collisions


# ------------------------------------------------------------------ other modes
def test_in_altitude_the_height_is_kept_and_the_wind_is_not():
    flown = piloted(ALTITUDE)
    height_m = flown.run(2.0).height
    flown.simulator.order(Weather(east_m_s=5.0))
    flown.run(5.0)
    assert flown.height == pytest.approx(height_m, abs=0.1)
    assert flown.position[0] > 0.5
    flown.hold_sticks(pitch=500).run(1.0)
    assert flown.autopilot.snapshot.pitch_rad == pytest.approx(-math.radians(17.5), abs=0.04)


@pytest.mark.parametrize("mode", [STABILIZED, MANUAL])
def test_in_stabilized_the_sticks_are_tilt_and_thrust(mode):
    flown = piloted(mode)
    assert abs(flown.velocity[2]) < 0.5  # the middle of the throttle hovers
    flown.hold_sticks(roll=1000, throttle=600).run(1.0)
    assert flown.autopilot.snapshot.roll_rad == pytest.approx(math.radians(35.0), abs=0.06)
    assert flown.velocity[0] > 1.0
    flown.hold_sticks(throttle=400).run(1.0)
    assert flown.velocity[2] < -0.5
    assert abs(flown.autopilot.snapshot.roll_rad) < 0.06


def test_in_stabilized_the_throttle_down_on_the_ground_disarms():
    flown = Flown().boot()
    flown.hold_sticks(throttle=0).run(0.2)
    flown.command(176, 1, *STABILIZED)
    assert flown.command(400, 1) == ACCEPTED
    flown.hold_sticks(throttle=650).run(2.0)
    assert flown.height > 1.0
    flown.hold_sticks(throttle=465)
    flown.until(lambda: flown.autopilot.snapshot.grounded == 1.0, 20.0)
    flown.hold_sticks(throttle=0)
    flown.until(lambda: not flown.armed, 10.0)


def test_in_acro_the_sticks_are_rates():
    flown = piloted(ACRO, 30.0)
    flown.hold_sticks(roll=200).run(0.5)
    assert flown.autopilot.snapshot.p_rad_s == pytest.approx(math.radians(20.0), abs=0.05)
    flown.hold_sticks().run(0.5)
    rolled = flown.autopilot.snapshot.roll_rad
    assert rolled > 0.1
    assert flown.run(0.5).autopilot.snapshot.roll_rad == pytest.approx(rolled, abs=0.06)  # nothing levels it


# ------------------------------------------------------------------- arming
@pytest.mark.parametrize("mode", [POSITION, ALTITUDE, STABILIZED])
def test_nobody_arms_with_a_high_throttle(mode):
    flown = Flown().boot()
    flown.hold_sticks(throttle=900).run(0.2)
    flown.command(176, 1, *mode)
    assert flown.command(400, 1) == TEMPORARILY_REJECTED
    assert flown.texts[-1] == "Arming denied: high throttle"
    flown.hold_sticks(throttle=0).run(0.2)
    assert flown.command(400, 1) == ACCEPTED


@pytest.mark.parametrize("setting", [0, 4])
def test_where_no_joystick_counts_position_is_not_available(setting):
    flown = Flown().take_off(3.0)
    flown.set_parameter("COM_RC_IN_MODE", setting)
    flown.hold_sticks().run(0.2)
    assert flown.command(176, 1, *POSITION) == TEMPORARILY_REJECTED


@pytest.mark.parametrize("sticks", [(32767, 0, 500, 0), (0, 0, -1, 0), (0, -1001, 500, 0)])
def test_what_is_beyond_a_stick_is_none(sticks):
    flown = Flown().take_off(3.0)
    flown.send(mavlink.MAVLink_manual_control_message(1, *sticks, 0))
    assert flown.command(176, 1, *POSITION) == TEMPORARILY_REJECTED


def test_sticks_of_another_vehicle_are_not_ours():
    flown = Flown().take_off(3.0)
    flown.send(mavlink.MAVLink_manual_control_message(2, 0, 0, 500, 0, 0))
    assert flown.command(176, 1, *POSITION) == TEMPORARILY_REJECTED


# ------------------------------------------------------------ taking over, leaving
def test_a_pilot_takes_over_by_moving_the_sticks():
    flown = Flown().take_off(5.0)
    flown.hold_sticks().run(1.0)
    assert flown.mode == "HOLD"
    flown.hold_sticks(pitch=600).run(0.1)
    assert flown.mode == "POSITION"
    assert "Pilot took over using sticks" in flown.texts


@pytest.mark.parametrize(("override", "mode"), [(0, "HOLD"), (1, "POSITION")])
def test_taking_over_is_a_parameter(override, mode):
    flown = Flown().take_off(5.0)
    flown.set_parameter("COM_RC_OVERRIDE", override)
    flown.hold_sticks().run(0.5)
    assert flown.hold_sticks(roll=-800).run(0.1).mode == mode


@pytest.mark.parametrize(("override", "mode"), [(1, "OFFBOARD"), (3, "POSITION")])
def test_offboard_is_taken_over_only_where_that_is_allowed(override, mode):
    flown = Flown().take_off(5.0)
    flown.set_parameter("COM_RC_OVERRIDE", override)
    flown.stream(position=(0.0, 0.0, -5.0)).offboard()
    flown.hold_sticks().run(0.5)
    assert flown.hold_sticks(roll=-800).run(0.1).mode == mode


def test_sticks_that_stop_in_position_hold_for_a_second_then_return():
    flown = piloted(POSITION).let_go()
    assert flown.until(lambda: flown.mode == "HOLD", 2.0) == pytest.approx(0.55, abs=0.2)
    assert flown.texts[-1] == "Failsafe activated: entering Hold for 1 seconds"
    assert flown.until(lambda: flown.mode == "RTL", 3.0) == pytest.approx(1.0, abs=0.1)


def test_sticks_that_stop_in_hold_are_missed_for_five_seconds():
    flown = Flown().take_off(5.0)
    flown.hold_sticks().run(1.0)
    flown.let_go().run(0.8)
    assert flown.texts[-1] == "Failsafe activated: entering Hold for 5 seconds"
    assert flown.until(lambda: flown.mode == "RTL", 6.0) == pytest.approx(4.7, abs=0.3)


def test_who_flies_without_sticks_does_not_miss_them():
    assert Flown().take_off(5.0).run(10.0).last("HEARTBEAT").system_status == 4


@pytest.mark.parametrize(("bits", "mode"), [(2, "HOLD"), (1, "RTL")])
def test_modes_that_do_without_sticks_are_a_parameter(bits, mode):
    flown = Flown().take_off(5.0)
    flown.set_parameter("COM_RCL_EXCEPT", bits)
    flown.hold_sticks().run(0.5)
    assert flown.let_go().run(7.0).mode == mode


@pytest.mark.parametrize(("action", "mode"), [(1, "HOLD"), (3, "LAND"), (5, "TERMINATION")])
def test_what_is_done_about_missing_sticks_is_a_parameter(action, mode):
    flown = piloted(POSITION)
    flown.set_parameter("NAV_RCL_ACT", action)
    assert flown.let_go().run(2.5).mode == mode


@pytest.mark.parametrize(("setting", "mode"), [(0, "POSITION"), (1, "ALTITUDE"), (2, "STABILIZED")])
def test_sticks_are_what_offboard_falls_back_to(setting, mode):
    flown = Flown().take_off(5.0)
    flown.set_parameter("COM_OBL_RC_ACT", setting)
    flown.stream(position=(0.0, 0.0, -5.0)).offboard()
    flown.hold_sticks().run(0.5)
    flown.go_silent().run(4.0)
    assert flown.mode == mode
    assert flown.height == pytest.approx(5.0, abs=0.5)


def test_a_pilot_goes_on_by_altitude_when_the_position_is_lost():
    flown = piloted(POSITION)
    flown.simulator.order(GpsLoss())
    flown.run(5.5)
    assert flown.mode == "ALTITUDE"
    assert flown.run(2.0).height == pytest.approx(10.0, abs=0.3)
    assert flown.command(176, 1, *STABILIZED) == ACCEPTED
    assert flown.command(176, 1, *POSITION) == TEMPORARILY_REJECTED


def test_a_stick_mode_shows_in_the_heartbeat_as_armed():
    flown = piloted(POSITION)
    heartbeat = flown.run(1.0).last("HEARTBEAT")
    assert (heartbeat.custom_mode, heartbeat.base_mode, heartbeat.system_status) == (0x00030000, 81 + 128, 4)


def test_a_take_off_goes_on_with_a_joystick_at_rest():
    flown = Flown().boot()
    flown.hold_sticks().run(0.5)
    flown.command(22, *[NAN] * 7)
    flown.command(400, 1)
    assert flown.run(12.0).mode == "HOLD"
    assert flown.height == pytest.approx(2.5, abs=0.2)
