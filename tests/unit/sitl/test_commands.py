"""Every command has PX4's answer, whoever asks, and a repeated copy has no second effect."""

import math
import struct

import numpy as np
import pytest

from missions.mission import Positioning
from sitl.dialect import mavlink
from sitl.microservices.outbox import Link
from tests.unit.sitl.flown import NAN, Flown, field, place, waypoint

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = range(5)
CANCELLED = 6

ON_THE_GROUND = [
    *[(number, (), UNSUPPORTED) for number in (16, 17, 92, 115, 183, 193, 207, 208, 224, 2000, 31000, 40000, 65000)],
    *[(number, (), None) for number in (211, 420, 1000, 3000)],
    *[(number, (), ACCEPTED) for number in (20, 21, 401, 410, 520)],
    (34, (10, 2, 0, 0, 47.4, 8.5, 500.0), ACCEPTED),
    (187, (0.5,), ACCEPTED),
    (195, (0, 0, 0, 0, 47.4, 8.5, 500.0), ACCEPTED),
    (195, (0, 0, 0, 0, NAN, NAN, 500.0), DENIED),
    (197, (), ACCEPTED),
    (178, (1, 3), ACCEPTED),
    (186, (500.0,), ACCEPTED),
    (189, (), CANCELLED),
    (191, (), ACCEPTED),
    (201, (3, 0, 0, 0, 47.4, 8.5, 500.0), ACCEPTED),
    (201, (0,), ACCEPTED),
    (201, (4, 1), UNSUPPORTED),
    *[(245, (number,), ACCEPTED) for number in range(5)],
    (245, (9,), DENIED),
    (519, (1,), ACCEPTED),
    (528, (1,), ACCEPTED),
    (178, (1, -5), ACCEPTED),
    (179, (1,), ACCEPTED),
    (179, (0, 0, 0, 0, 47.4, 8.5, 480.0), ACCEPTED),
    (179, (0, 0, 0, 0, NAN, 8.5, 480.0), DENIED),
    (185, (0,), DENIED),
    (192, (-1, 1, 0, NAN, 47.9, 8.5, 500.0), ACCEPTED),
    (192, (-1, 0, 0, NAN, 47.9, 8.5, 500.0), UNSUPPORTED),
    (192, (-1, 1, 0, NAN, 147.9, 8.5, 500.0), DENIED),
    (246, (0,), ACCEPTED),
    (246, (1,), ACCEPTED),
    (246, (2,), UNSUPPORTED),
    (262, (5,), ACCEPTED),
    (262, (99,), FAILED),
    (300, (), DENIED),
    (400, (math.inf,), DENIED),
    (510, (30,), ACCEPTED),
    (510, (1e9,), DENIED),
    (511, (30, 20000), ACCEPTED),
    (511, (99999, 20000), FAILED),
    (511, (30, NAN), DENIED),
    (511, (132, 20000), ACCEPTED),
    (511, (246, 20000), ACCEPTED),
    (511, (0, 20000), FAILED),
    *[(512, (number,), ACCEPTED) for number in (0, 26, 115, 132, 148, 242, 264, 300, 331, 375, 395, 397, 436)],
    (512, (87,), DENIED),
    (512, (330,), DENIED),
    (512, (360,), DENIED),
    (512, (42,), DENIED),
    (512, (259,), DENIED),
    (512, (340,), DENIED),
    (512, (NAN,), DENIED),
]


@pytest.mark.parametrize(("number", "params", "result"), ON_THE_GROUND)
def test_answers_on_the_ground(number, params, result):
    assert Flown().boot().command(number, *params) == result


def test_the_answer_is_for_the_asker_on_its_link():
    flown = Flown().boot()
    flown.command(401, link=Link.ONBOARD)
    ack = flown.last("COMMAND_ACK", link=Link.ONBOARD)
    assert (ack.target_system, ack.target_component) == (1, 191)
    assert not flown.messages("COMMAND_ACK", link=Link.GROUND)


@pytest.mark.parametrize(
    ("target", "heard"), [((1, 1), True), ((1, 0), True), ((1, 50), False), ((77, 1), False), ((0, 0), False)]
)
def test_commands_for_others_are_met_with_silence(target, heard):
    flown = Flown().boot()
    flown.send(mavlink.MAVLink_command_long_message(*target, 400, 0, 1, *[0] * 6))
    flown.run(0.1)
    assert bool(flown.messages("COMMAND_ACK")) == heard
    assert flown.armed == heard


def test_a_repeated_copy_is_acknowledged_again_without_a_second_effect():
    flown = Flown().boot()
    assert flown.command(400, 1) == ACCEPTED
    assert flown.command(400, 0) == ACCEPTED
    for confirmation in (1, 2, 3):
        assert flown.command(400, 0, confirmation=confirmation) == ACCEPTED
    assert flown.texts.count("Disarmed by external command") == 1
    flown.command(400, 1)
    assert flown.command(400, 0) == ACCEPTED  # a new order
    assert not flown.armed


def test_a_copy_counts_when_the_first_was_lost():
    flown = Flown().boot()
    assert flown.command(400, 1, confirmation=1) == ACCEPTED
    assert flown.armed


def test_repositions_fly_to_the_place_at_the_amsl_altitude():
    flown = Flown().take_off(4.0)
    x, y = place(6.0, -4.0)
    assert flown.command(192, -1, 1, 0, math.pi / 2, x * 1e-7, y * 1e-7, 489.4 + 7.0) == ACCEPTED
    flown.run(15.0)
    assert np.allclose(flown.position, [-4.0, 6.0, 7.0], atol=0.15)
    assert flown.autopilot.snapshot.yaw_rad == pytest.approx(math.pi / 2, abs=0.1)


@pytest.mark.parametrize("frame", [0, 3, 5, 6, 11])
def test_command_int_repositions_take_amsl_in_every_frame(frame):
    flown = Flown().take_off(4.0)
    x, y = place(3.0, 0.0)
    flown.send(mavlink.MAVLink_command_int_message(1, 1, frame, 192, 0, 0, -1, 1, 0, NAN, x, y, 489.4 + 6.0))
    flown.run(10.0)
    assert flown.last("COMMAND_ACK").result == ACCEPTED
    assert np.allclose(flown.position, [0.0, 3.0, 6.0], atol=0.15)


@pytest.mark.parametrize(("mode", "north_m"), [((4, 3), 6.0), ((4, 5), 0.0)])
def test_a_reposition_that_switches_no_mode_counts_only_in_hold(mode, north_m):
    flown = Flown().take_off(4.0)
    flown.command(176, 1, *mode)
    x, y = place(6.0, 0.0)
    assert flown.command(192, -1, 0, 0, NAN, x * 1e-7, y * 1e-7, 489.4 + 4.0) == UNSUPPORTED
    flown.run(8.0)
    assert flown.position[1] == pytest.approx(north_m, abs=0.2)


def test_numbers_left_out_keep_what_there_is_and_nothing_at_all_is_a_pause():
    flown = Flown().take_off(4.0)
    flown.command(192, -1, 1, 0, NAN, NAN, NAN, 489.4 + 6.0)
    flown.run(8.0)
    assert np.allclose(flown.position, [0.0, 0.0, 6.0], atol=0.15)
    x, y = place(60.0, 0.0)
    flown.command(192, -1, 1, 0, NAN, x * 1e-7, y * 1e-7, NAN)
    flown.run(5.0)
    flown.command(192, -1, 1, 0, NAN, NAN, NAN, NAN)
    flown.run(10.0)
    assert flown.position[1] < 30.0
    assert np.linalg.norm(flown.velocity) < 0.1


def test_a_reposition_takes_a_vehicle_off_that_holds_on_the_ground():
    flown = Flown().boot()
    flown.command(400, 1)
    x, y = place(0.0, 0.0)
    assert flown.command(192, -1, 1, 0, NAN, x * 1e-7, y * 1e-7, 489.4 + 4.0) == ACCEPTED
    flown.run(12.0)
    assert flown.height == pytest.approx(4.0, abs=0.2)


def test_change_speed_holds_for_what_is_flown_next():
    flown = Flown().take_off(4.0)
    flown.command(178, 1, 2.0)
    x, y = place(40.0, 0.0)
    flown.command(192, -1, 1, 0, NAN, x * 1e-7, y * 1e-7, 493.4)
    flown.run(8.0)
    assert flown.velocity[1] == pytest.approx(2.0, abs=0.2)


def test_a_reboot_in_the_air_is_denied():
    assert Flown().take_off(3.0).command(246, 1) == DENIED


def radius(flown: Flown, north_m: float, east_m: float) -> float:
    return float(np.hypot(flown.position[1] - north_m, flown.position[0] - east_m))


@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_an_orbit_is_flown_around_its_centre_with_the_nose_to_it(turn):
    flown = Flown().take_off(4.0)
    x, y = place(12.0, 0.0)
    assert flown.command(34, turn * 6.0, 2.0, 0, NAN, x * 1e-7, y * 1e-7, 489.4 + 5.0) == ACCEPTED
    flown.run(15.0)
    assert flown.last("HEARTBEAT").custom_mode == 0x01030000
    bearings = []
    for _ in range(20):
        flown.run(0.5)
        assert radius(flown, 12.0, 0.0) == pytest.approx(6.0, abs=0.4)
        assert np.linalg.norm(flown.velocity) == pytest.approx(2.0, abs=0.3)
        to_centre = math.atan2(-flown.position[0], 12.0 - flown.position[1])
        assert abs(math.remainder(flown.autopilot.snapshot.yaw_rad - to_centre, 2 * math.pi)) < 0.3
        bearings.append(math.atan2(flown.position[0], flown.position[1] - 12.0))
    assert flown.height == pytest.approx(5.0, abs=0.2)
    turned = np.unwrap(bearings)[-1] - bearings[0]
    assert turned == pytest.approx(turn * 2.0 / 6.0 * 9.5, abs=0.5)


def test_the_nose_turns_to_the_region_of_interest_and_away_again():
    flown = Flown().take_off(4.0)
    x, y = place(0.0, 50.0)
    flown.command(195, 0, 0, 0, 0, x * 1e-7, y * 1e-7, 489.4)
    flown.run(5.0)
    assert flown.autopilot.snapshot.yaw_rad == pytest.approx(math.pi / 2, abs=0.05)
    x, y = place(40.0, 0.0)
    flown.command(192, -1, 1, 0, NAN, x * 1e-7, y * 1e-7, 493.4)
    flown.run(6.0)
    to_place = math.atan2(50.0 - flown.position[0], -flown.position[1])
    assert flown.autopilot.snapshot.yaw_rad == pytest.approx(to_place, abs=0.1)
    flown.command(197)
    flown.run(4.0)
    assert abs(flown.autopilot.snapshot.yaw_rad) < 0.1  # along the way


# ---------------------------------------------------------------------- reboot
def test_a_reboot_is_answered_then_silent_then_a_boot_that_remembers():
    flown = Flown().boot()
    flown.set_parameter("MIS_TAKEOFF_ALT", 6.0)
    flown.upload([waypoint(5.0, 0.0, 4.0)])
    plan = flown.last("MISSION_CURRENT").mission_id
    assert flown.command(246, 1) == ACCEPTED
    flown.forget()
    flown.run(0.9)
    assert not flown.heard(Link.GROUND)
    assert flown.command(401) is None
    flown.run(1.2)
    assert flown.last("ATTITUDE").time_boot_ms < 1500
    assert flown.last("HEARTBEAT").system_status == 3
    assert flown.autopilot.parameters.stored("MIS_TAKEOFF_ALT") == 6.0
    assert flown.last("MISSION_CURRENT").mission_id == plan != 0
    assert flown.command(300) == ACCEPTED


def test_utc_goes_on_through_a_reboot():
    flown = Flown().boot()
    before = flown.last("SYSTEM_TIME").time_unix_usec
    at_s = flown.last("SYSTEM_TIME").time_boot_ms / 1e3
    flown.command(246, 1)
    flown.run(3.0)
    after = flown.last("SYSTEM_TIME")
    assert after.time_boot_ms < 3000
    assert before < after.time_unix_usec < before + (flown.time_s - at_s) * 1e6 + 1


def test_requested_messages_come_once():
    flown = Flown().boot()
    for number, name in (
        (148, "AUTOPILOT_VERSION"),
        (49, "GPS_GLOBAL_ORIGIN"),
        (242, "HOME_POSITION"),
        (331, "ODOMETRY"),
    ):
        flown.forget()
        assert flown.command(512, number) == ACCEPTED
        assert len(flown.messages(name)) == 1, name


def test_the_modes_can_be_asked_for():
    flown = Flown().boot()
    flown.command(512, 435, 0)
    modes = flown.messages("AVAILABLE_MODES")
    assert len(modes) == modes[0].number_modes
    assert {m.custom_mode for m in modes} >= {0x03040000, 0x00060000}
    flown.forget()
    flown.command(512, 435, 2)
    assert [m.mode_index for m in flown.messages("AVAILABLE_MODES")] == [2]


def test_the_autopilot_says_what_it_can():
    flown = Flown().boot()
    flown.command(512, 148)
    capabilities = flown.last("AUTOPILOT_VERSION").capabilities
    assert capabilities == 0xE8FF & ~mavlink.MAV_PROTOCOL_CAPABILITY_FTP  # PX4's, but for what is not here


def test_the_same_order_given_again_is_a_new_order():
    flown = Flown().take_off(4.0)
    flown.command(21)
    flown.command(176, 1, 4, 3)
    assert flown.mode == "HOLD"
    flown.command(21)
    assert flown.mode == "LAND"


def test_messages_for_absent_equipment_can_be_ordered_and_do_not_come():
    flown = Flown().boot()
    flown.command(511, 246, 20000)
    flown.run(0.5)
    assert not flown.messages("ADSB_VEHICLE")
    flown.command(510, 246)
    assert flown.last("MESSAGE_INTERVAL").interval_us == 0


def test_failures_are_not_injected_by_command_and_said_so_where_that_is_enabled():
    flown = Flown().boot()
    assert flown.command(420, 4, 1) is None
    flown.set_parameter("SYS_FAILURE_EN", 1)
    assert flown.command(420, 4, 1) == UNSUPPORTED


def test_a_request_for_files_is_refused_at_once():
    flown = Flown().boot()
    list_directory = bytes([7, 0, 0, 3, 1, 0, 0, 0, 0, 0, 0, 0]) + b"/"
    payload = list(list_directory.ljust(251, b"\0"))
    flown.send(mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, payload))
    answer = flown.last("FILE_TRANSFER_PROTOCOL")
    assert (answer.target_system, answer.target_component) == (255, 190)
    seq, opcode, size, requested, error = *answer.payload[:2:2], *answer.payload[3:6], answer.payload[12]
    assert (seq, opcode, size, requested, error) == (8, 129, 1, 3, 7)
    flown.forget()
    flown.send(mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, answer.payload))
    assert not flown.messages("FILE_TRANSFER_PROTOCOL")


def test_there_are_no_logs_and_one_entry_says_so():
    flown = Flown().boot()
    flown.send(mavlink.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    assert [entry.num_logs for entry in flown.messages("LOG_ENTRY")] == [0]


def test_the_protocol_version_comes_when_it_is_asked_for():
    flown = Flown().boot()
    assert flown.command(519, 1) == ACCEPTED
    (frame,) = [frame for frame in flown.heard(Link.GROUND) if frame[7:10] == (300).to_bytes(3, "little")]
    assert struct.unpack("<HHH", frame[10:-2].ljust(6, b"\0")) == (200, 100, 200)
    assert mavlink.x25crc(frame[1:-2] + b"\xd9").crc == int.from_bytes(frame[-2:], "little")


def test_component_metadata_names_no_files():
    flown = Flown().boot()
    for number in (395, 397):
        assert flown.command(512, number) == ACCEPTED
        (frame,) = [frame for frame in flown.heard(Link.GROUND) if frame[7:10] == number.to_bytes(3, "little")]
        assert len(frame) <= 10 + 4 + 2, "nothing but the time since boot"


def test_the_range_finder_looks_down():
    flown = Flown().take_off(6.0).run(4.0)
    sensor = flown.last("DISTANCE_SENSOR")
    assert sensor.orientation == 25
    assert sensor.current_distance == pytest.approx(100.0 * flown.position[2], abs=5)


def test_the_ground_truth_is_given_away_on_request():
    gnss = Positioning(horizontal_std_m=1.0, vertical_std_m=1.0, velocity_std_m_s=0.2)
    flown = Flown(field(positioning=gnss)).take_off(6.0).run(2.0)
    flown.command(511, 115, 20000)
    flown.run(0.1)
    truth = flown.last("HIL_STATE_QUATERNION")
    enu = flown.simulator.mission.frame.enu(truth.lat * 1e-7, truth.lon * 1e-7, truth.alt * 1e-3)
    np.testing.assert_allclose(enu, flown.position, atol=0.05)


def test_an_orbit_says_around_what():
    flown = Flown().take_off(6.0)
    latitude_e7, longitude_e7 = place(10.0, 20.0)
    flown.command(34, -12, 3, 0, NAN, latitude_e7 * 1e-7, longitude_e7 * 1e-7, 496.0)
    flown.run(3.0)
    status = flown.last("ORBIT_EXECUTION_STATUS")
    assert status.radius == -12.0
    np.testing.assert_allclose((status.x, status.y), (latitude_e7, longitude_e7), atol=10)


def test_flight_information_knows_when_this_flight_began():
    flown = Flown().take_off(6.0)
    assert flown.command(528, 1) == ACCEPTED
    flight, utc_us = flown.last("FLIGHT_INFORMATION"), flown.last("SYSTEM_TIME").time_unix_usec
    assert utc_us - 60e6 < flight.arming_time_utc < flight.takeoff_time_utc < utc_us
    assert flight.flight_uuid == 1


def test_the_altitude_alone_can_be_changed():
    flown = Flown().take_off(6.0)
    assert flown.command(186, 489.4 + 9.0) == ACCEPTED
    flown.run(8.0)
    np.testing.assert_allclose(flown.position, [0.0, 0.0, 9.0], atol=0.3)


def test_parameters_go_back_to_their_defaults_on_the_ground_alone():
    flown = Flown().boot()
    flown.simulator.vehicles[1].autopilot.parameters.set("MIS_TAKEOFF_ALT", 6.0)
    assert flown.command(245, 2) == ACCEPTED
    assert flown.simulator.vehicles[1].autopilot.parameters["MIS_TAKEOFF_ALT"] == 2.5
    assert flown.simulator.memories[1].parameters == {}
    assert flown.take_off(6.0).command(245, 2) == TEMPORARILY_REJECTED


def test_the_origin_stays_where_it_is_and_is_told_to_who_wants_another():
    flown = Flown().boot()
    flown.send(mavlink.MAVLink_set_gps_global_origin_message(1, 400_000_000, 80_000_000, 0, 0))
    assert flown.last("GPS_GLOBAL_ORIGIN").latitude == pytest.approx(473_977_432, abs=10)
