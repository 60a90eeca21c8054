"""Offboard: what is a setpoint, what it does, and what happens when there are none."""

import math

import numpy as np
import pytest

from missions.mission import Positioning
from sitl.dialect import mavlink
from sitl.dynamics.airframe import SIH
from sitl.microservices.outbox import Link
from tests.unit.sitl.flown import NAN, Flown, field

ACCEPTED, TEMPORARILY_REJECTED = 0, 1


def hovering(**options) -> Flown:
    """In Offboard at 3 m above the origin, heading north."""
    flown = Flown(**options).take_off(3.0)
    return flown.stream(position=(0.0, 0.0, -3.0)).offboard().run(3.0)


def test_offboard_needs_a_fresh_setpoint():
    flown = Flown().take_off(3.0)
    assert flown.command(176, 1, 6) == TEMPORARILY_REJECTED
    flown.stream(position=(0.0, 0.0, -3.0)).run(0.02)
    flown.go_silent().run(0.8)
    assert flown.command(176, 1, 6) == ACCEPTED
    flown.command(176, 1, 4, 3)
    flown.run(1.5)
    assert flown.command(176, 1, 6) == TEMPORARILY_REJECTED


def test_one_setpoint_just_before_the_command_is_enough():
    flown = Flown().take_off(3.0)
    flown.send(
        mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 0xDF8, 0, 0, -3, *[0] * 8), link=Link.ONBOARD
    )
    assert flown.command(176, 1, 6, link=Link.ONBOARD) == ACCEPTED


def test_offboard_may_be_left_and_entered_again_on_the_same_setpoint():
    flown = hovering()
    flown.stream(velocity=(0.0, 1.0, 0.0)).run(0.1)
    flown.go_silent().run(0.1)
    flown.command(176, 1, 4, 3)
    assert flown.command(176, 1, 6, link=Link.ONBOARD) == ACCEPTED
    assert flown.run(0.5).velocity[0] > 0.3


@pytest.mark.parametrize(
    ("mask", "position", "velocity", "acceleration", "moves_north"),
    [
        (0xDF8, (2, 0, -3), (0, 0, 0), (0, 0, 0), True),
        (0x9F8, (2, 0, -3), (0, 0, 0), (0, 0, 0), True),
        (0x5F8, (2, 0, -3), (0, 0, 0), (0, 0, 0), True),
        (0xDC7, (0, 0, 0), (1, 0, 0), (0, 0, 0), True),
        (0x9C7, (0, 0, 0), (1, 0, 0), (0, 0, 0), True),
        (0xDC0, (2, 0, -3), (0.1, 0, 0), (0, 0, 0), True),
        (0xC00, (2, 0, -3), (0.1, 0, 0), (0.1, 0, 0), True),
        (0xC3F, (0, 0, 0), (0, 0, 0), (1, 0, 0), True),
        (0xC3B, (0, 0, -3), (0, 0, 0), (1, 0, 0), True),
        (0xDE3, (0, 0, -3), (1, 0, 0), (0, 0, 0), True),
        (0xDDC, (2, 0, 0), (0, 0, 0), (0, 0, 0), True),
        (0x000, (2, 0, -3), (0.1, 0, 0), (0, 0, 0), True),
        (0xDFE, (2, 0, 0), (0, 0, 0), (0, 0, 0), False),  # x alone
        (0xDFB, (0, 0, -9), (0, 0, 0), (0, 0, 0), False),  # z alone
        (0xDFC, (2, 0, 0), (0, 0, 0), (0, 0, 0), False),  # nothing for z
    ],
)
def test_every_useful_combination_flies_and_the_others_hold(mask, position, velocity, acceleration, moves_north):
    flown = hovering()
    flown.stream(position, velocity, acceleration, mask=mask).run(2.0)
    assert flown.mode == "OFFBOARD"
    assert (flown.position[1] > 0.5) == moves_north
    assert abs(flown.height - 3.0) < 0.3


@pytest.mark.parametrize(
    ("mask", "frame", "text"),
    [
        (0xFFF, 1, "invalid"),
        (0xBFF, 1, "invalid"),  # yaw alone
        (0xFF8, 1, "force not supported"),
        (0xDF8, 0, "coordinate frame 0 unsupported"),
        (0xDF8, 9, "coordinate frame 9 unsupported"),
        (0xDF8, 8, "LOCAL_NED invalid"),
    ],
)
def test_what_is_no_setpoint_is_refused_and_lets_the_old_one_run_out(mask, frame, text):
    flown = hovering()
    flown.stream((1, 0, -3), mask=mask, frame=frame).run(0.5)
    assert text in flown.texts[-1]
    flown.run(1.0)
    assert "Failsafe activated" in flown.texts


def test_velocities_in_the_bodys_frame_follow_the_heading():
    flown = hovering()
    flown.stream(position=(0.0, 0.0, -3.0), yaw=math.pi / 2).run(3.0)
    flown.stream(velocity=(1.0, 0.0, 0.0), yaw=0.0, frame=8).run(3.0)
    assert flown.position[0] > 1.5  # forwards is east
    assert abs(flown.position[1]) < 0.2


@pytest.mark.parametrize(("frame", "altitude"), [(5, 489.4 + 3.0), (6, 3.0), (11, 3.0)])
def test_global_setpoints_fly(frame, altitude):
    flown = hovering().go_silent()
    latitude = round((47.3977432 + math.degrees(3.0 / 6_371_000.0)) * 1e7)
    message = mavlink.MAVLink_set_position_target_global_int_message(
        0, 1, 1, frame, 0xDF8, latitude, 85455942, altitude, *[0.0] * 8
    )
    for _ in range(200):
        flown.send(message, link=Link.ONBOARD)
        flown.run(0.04)
    assert flown.position[1] == pytest.approx(3.0, abs=0.1)
    assert flown.height == pytest.approx(3.0, abs=0.1)


@pytest.mark.parametrize("frame", [0, 3, 10])
def test_other_global_frames_are_refused(frame):
    flown = hovering()
    message = mavlink.MAVLink_set_position_target_global_int_message(0, 1, 1, frame, 0xDF8, 0, 0, 0.0, *[0.0] * 8)
    flown.send(message, link=Link.ONBOARD)
    assert "invalid coordinate frame" in flown.run(0.1).texts[-1]


def test_attitude_setpoints_tilt_the_vehicle():
    flown = hovering().go_silent()
    half = math.radians(-10.0) / 2
    q = [math.cos(half), 0.0, math.sin(half), 0.0]  # nose down
    hover = flown.autopilot.snapshot.thrust
    for _ in range(50):
        flown.send(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 7, q, 0, 0, 0, hover), link=Link.ONBOARD)
        flown.run(0.02)
    assert flown.mode == "OFFBOARD"
    assert flown.velocity[1] > 0.5
    assert math.degrees(flown.autopilot.snapshot.pitch_rad) == pytest.approx(-10.0, abs=1.5)


def test_an_attitude_without_thrust_sinks():
    flown = Flown().take_off(20.0)
    for _ in range(60):
        message = mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 64, [1.0, 0, 0, 0], 0, 0, 0, 0.9)
        flown.send(message, link=Link.ONBOARD)
        flown.run(0.02)
        if flown.mode != "OFFBOARD":
            flown.command(176, 1, 6, link=Link.ONBOARD)
    assert flown.velocity[2] < -3.0


def test_body_rates_turn_the_vehicle():
    flown = hovering().go_silent()
    hover = flown.autopilot.snapshot.thrust
    for _ in range(50):
        message = mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 128, [1.0, 0, 0, 0], 0, 0, 0.5, hover)
        flown.send(message, link=Link.ONBOARD)
        flown.run(0.02)
    assert flown.autopilot.snapshot.r_rad_s == pytest.approx(0.5, abs=0.1)


def test_numbers_that_are_none_free_their_axis_and_reach_no_control():
    flown = hovering()
    codec = mavlink.MAVLink(None, 1, 191)
    message = mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 0, NAN, math.inf, NAN, *[NAN] * 8)
    for _ in range(30):
        flown.simulator.receive(1, Link.ONBOARD, message.pack(codec))
        flown.run(0.02)
    assert np.isfinite(flown.simulator.truth.position_enu_m).all()
    assert flown.height == pytest.approx(3.0, abs=0.2)


def test_arming_in_offboard_takes_off_to_the_setpoint():
    flown = Flown().boot()
    flown.stream(position=(0.0, 0.0, -6.0)).run(0.2)
    assert flown.command(176, 1, 6, link=Link.ONBOARD) == ACCEPTED
    assert flown.command(400, 1, link=Link.ONBOARD) == ACCEPTED
    assert flown.until(lambda: flown.height > 5.5, 12.0) < 9.0


def test_setpoints_for_another_system_are_ignored():
    flown = Flown().take_off(3.0)
    message = mavlink.MAVLink_set_position_target_local_ned_message(0, 2, 1, 1, 0xDF8, 0, 0, -3, *[0] * 8)
    flown.send(message, link=Link.ONBOARD)
    assert flown.command(176, 1, 6) == TEMPORARILY_REJECTED


# ------------------------------------------------------------------------ loss
def test_without_setpoints_and_sticks_it_sinks_and_lands():
    flown = hovering().go_silent()
    lost_s = flown.until(lambda: "Failsafe activated" in flown.texts, 2.0)
    assert lost_s == pytest.approx(1.0, abs=0.1)
    flown.run(1.0)
    heartbeat, mode = flown.last("HEARTBEAT"), flown.autopilot.commander
    assert (heartbeat.custom_mode, heartbeat.system_status) == (0x00030000, 5)
    assert mode.intended.name == "OFFBOARD"
    assert flown.velocity[2] == pytest.approx(-0.7, abs=0.1)
    flown.until(lambda: not flown.armed, 20.0)
    assert flown.mode == "OFFBOARD"


@pytest.mark.parametrize(
    ("action", "custom_mode"), [(5, 0x03040000), (4, 0x06040000), (3, 0x05040000), (0, 0x00030000)]
)
def test_the_loss_action_is_the_parameters_and_setpoints_bring_offboard_back(action, custom_mode):
    flown = hovering()
    flown.set_parameter("COM_OBL_RC_ACT", action)
    flown.go_silent().run(2.2)
    assert flown.last("HEARTBEAT").custom_mode == custom_mode
    assert flown.last("HEARTBEAT").system_status == 5
    flown.stream(position=(0.0, 0.0, -3.0)).run(1.1)
    assert flown.mode == "OFFBOARD"
    assert flown.last("HEARTBEAT").system_status == 4


def test_hold_after_a_loss_keeps_its_height():
    flown = hovering()
    flown.set_parameter("COM_OBL_RC_ACT", 5)
    flown.go_silent().run(5.0)
    assert flown.height == pytest.approx(3.0, abs=0.1)


def test_a_mode_that_the_pilot_chooses_ends_the_failsafe():
    flown = hovering()
    flown.set_parameter("COM_OBL_RC_ACT", 5)
    flown.go_silent().run(2.0)
    assert flown.command(176, 1, 4, 3) == ACCEPTED
    flown.run(1.2)
    assert flown.last("HEARTBEAT").system_status == 4
    flown.stream(position=(0.0, 0.0, -3.0)).run(1.0)
    assert flown.mode == "HOLD"


def test_slow_setpoints_are_enough_and_too_slow_ones_are_not():
    flown = hovering().go_silent()
    message = mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 0xDF8, 0, 0, -3, *[0] * 8)
    for _ in range(8):
        flown.send(message, link=Link.ONBOARD)
        flown.run(0.7)
    assert "Failsafe activated" not in flown.texts
    for _ in range(3):
        flown.send(message, link=Link.ONBOARD)
        flown.run(1.3)
    assert "Failsafe activated" in flown.texts


def test_with_a_speed_factor_the_timeout_stays_a_wall_clock_time():
    flown = Flown(speed=5.0).take_off(3.0)
    flown.stream(position=(0.0, 0.0, -3.0)).offboard().go_silent()
    assert flown.until(lambda: "Failsafe activated" in flown.texts, 8.0) == pytest.approx(5.0, abs=0.2)


# --------------------------------------------------------------------- quality
def test_hover_with_vision_grade_estimates_is_calm():
    flown = hovering(mission=field(positioning=Positioning()))
    track = []
    for _ in range(500):
        flown.run(0.04)
        track.append(flown.position)
    assert np.std(track, axis=0).max() < 0.04
    assert np.abs(np.mean(track, axis=0) - [0.0, 0.0, 3.0]).max() < 0.06


def circle(time_s: float, radius_m: float, speed_m_s: float):
    """Position, velocity and acceleration (NED) on a circle that is entered at rest."""
    ramp_s = 4.0
    w = speed_m_s / radius_m
    angle = w * (time_s - ramp_s / 2) if time_s > ramp_s else w * time_s**2 / (2 * ramp_s)
    rate = w if time_s > ramp_s else w * time_s / ramp_s
    change = 0.0 if time_s > ramp_s else w / ramp_s
    c, s = math.cos(angle), math.sin(angle)
    position = (radius_m * s, radius_m * (1 - c), -3.0)
    velocity = (radius_m * rate * c, radius_m * rate * s, 0.0)
    acceleration = (radius_m * (change * c - rate**2 * s), radius_m * (change * s + rate**2 * c), 0.0)
    return position, velocity, acceleration


def tracking_errors(feed_forward: float, radius_m: float) -> list[float]:
    """Distances to a setpoint that goes round at 3 m/s, with vision-grade estimates."""
    flown = hovering(mission=field(positioning=Positioning()))
    begin_s, errors = flown.time_s, []
    while flown.time_s - begin_s < 20.0:
        position, velocity, acceleration = circle(flown.time_s - begin_s, radius_m, 3.0)
        flown.stream(position, velocity, [feed_forward * a for a in acceleration]).run(0.02)
        east, north, up = flown.position
        errors.append(math.dist((north, east, -up), position))
    return errors


def test_a_wide_turn_at_three_metres_a_second_is_followed_within_fifteen_centimetres():
    assert np.median(tracking_errors(1.0, radius_m=15.0)) < 0.15


def test_a_tight_turn_is_followed_as_well_by_who_knows_that_px4_damps_its_acceleration():
    damping = 0.2  # MPC_XY_VEL_D_ACC takes this share of an acceleration away again
    assert np.percentile(tracking_errors(1.0 + damping, radius_m=6.0), 99) < 0.15
    assert np.percentile(tracking_errors(1.0, radius_m=6.0), 99) > 0.2


def test_the_sih_airframe_flies_as_well():
    flown = hovering(airframe=SIH)
    flown.stream(position=(5.0, 0.0, -3.0)).run(8.0)
    assert flown.position[1] == pytest.approx(5.0, abs=0.3)


def fastest_after_a_pause(pause_s: float, limit_m_s: float) -> float:
    """The highest speed when setpoints at 2.79 m/s pause for a while and go on where they would be by then."""
    acceleration_m_s2, cruise_m_s, paused_at_s = 1.5, 2.79, 4.0
    ramp_s = cruise_m_s / acceleration_m_s2
    flown = hovering()
    flown.set_parameter("MPC_XY_VEL_MAX", limit_m_s)
    begin_s, north, fastest_m_s = flown.time_s, flown.position[1], 0.0
    while (t := flown.time_s - begin_s) < 7.0:
        if not paused_at_s <= t < paused_at_s + pause_s:
            way_m = acceleration_m_s2 * t**2 / 2 if t < ramp_s else cruise_m_s * (t - ramp_s / 2)
            forward = (min(acceleration_m_s2 * t, cruise_m_s), 0.0, 0.0)
            flown.stream((north + way_m, 0.0, -3.0), forward, (acceleration_m_s2 if t < ramp_s else 0.0, 0.0, 0.0))
        flown.run(0.02)
        if t >= paused_at_s:
            fastest_m_s = max(fastest_m_s, float(np.linalg.norm(flown.velocity)))
    return fastest_m_s


def test_setpoints_that_were_late_are_not_caught_up_with_faster_than_the_autopilots_limit():
    assert fastest_after_a_pause(0.8, limit_m_s=12.0) > 3.1
    assert fastest_after_a_pause(0.8, limit_m_s=3.0) <= 3.0
