"""Booting, arming and choosing modes, answered as PX4 answers."""

import pytest

from sitl.microservices.outbox import Link
from tests.unit.sitl.flown import NAN, Flown, field

ACCEPTED, TEMPORARILY_REJECTED, DENIED = 0, 1, 2


def test_it_is_ready_to_arm_within_a_second_of_boot():
    flown = Flown().run(1.0)
    assert flown.last("SYS_STATUS").onboard_control_sensors_health & 0x10000000 or flown.run(1.0)
    flown.run(0.2)
    heartbeat = flown.last("HEARTBEAT")
    assert (heartbeat.custom_mode, heartbeat.base_mode, heartbeat.system_status) == (0x03040000, 29, 3)
    assert flown.command(400, 1) == ACCEPTED


def test_arming_right_after_boot_is_denied_with_a_text():
    flown = Flown().run(0.1)
    assert flown.command(400, 1) == TEMPORARILY_REJECTED
    assert flown.texts == ["Arming denied: Resolve system health failures first"]
    assert not flown.armed


def test_arming_twice_and_disarming_twice_are_accepted():
    flown = Flown().boot()
    assert [flown.command(400, 1), flown.command(400, 1), flown.command(400, 0), flown.command(400, 0)] == [
        ACCEPTED
    ] * 4
    assert flown.texts == ["Armed by external command", "Disarmed by external command"]


def test_a_vehicle_that_does_not_take_off_disarms_after_ten_seconds():
    flown = Flown().boot()
    flown.command(400, 1)
    assert flown.until(lambda: not flown.armed, 12.0) == pytest.approx(10.0, abs=0.1)
    assert flown.texts[-1] == "Disarmed by auto preflight disarming"


def test_forced_arming_goes_past_the_checks():
    flown = Flown().run(0.1)
    assert flown.command(400, 1, 21196) == ACCEPTED


@pytest.mark.parametrize(("param", "answer"), [(2.0, None), (NAN, None), (0.7, ACCEPTED)])
def test_arming_with_odd_numbers(param, answer):
    assert Flown().boot().command(400, param) == answer


def test_a_vehicle_in_the_air_does_not_disarm_unless_forced():
    flown = Flown().take_off(5.0)
    assert flown.command(400, 0) == TEMPORARILY_REJECTED
    assert flown.texts[-1] == "Disarming denied: not landed"
    assert flown.command(400, 0, 21196) == ACCEPTED
    assert flown.run(0.5).velocity[2] < -2.0
    assert flown.command(400, 1) == ACCEPTED  # it can be armed again on the way down


ON_THE_GROUND = [
    ((1, 0), 0x00010000, 81),
    ((2, 0), 0x00020000, 81),
    ((3, 0), 0x00030000, 81),
    ((3, 1), 0x00030000, 81),
    ((3, 2), 0x02030000, 81),
    ((5, 0), 0x00050000, 65),
    ((6, 0), 0x00060000, 1),
    ((7, 0), 0x00070000, 81),
    ((4, 0), 0x04040000, 29),
    ((4, 2), 0x02040000, 29),
    ((4, 3), 0x03040000, 29),
    ((4, 4), 0x04040000, 29),
    ((4, 5), 0x05040000, 29),
    ((4, 6), 0x06040000, 29),
    ((4, 8), 0x08040000, 17),
]


@pytest.mark.parametrize(("mode", "custom_mode", "base_mode"), ON_THE_GROUND)
def test_every_mode_can_be_chosen_on_the_ground_and_shows_in_the_heartbeat(mode, custom_mode, base_mode):
    flown = Flown().boot()
    assert flown.command(176, 1, *mode) == ACCEPTED
    flown.run(1.0)
    heartbeat = flown.last("HEARTBEAT")
    assert (heartbeat.custom_mode, heartbeat.base_mode) == (custom_mode, base_mode)


@pytest.mark.parametrize("mode", [(1, 0), (3, 0), (4, 5), (4, 6), (6, 0), (4, 4)])
def test_modes_that_cannot_be_armed_say_so(mode):
    flown = Flown().boot()
    flown.command(176, 1, *mode)
    flown.run(1.0)
    assert flown.last("HEARTBEAT").system_status == 0
    assert flown.command(400, 1) == TEMPORARILY_REJECTED


@pytest.mark.parametrize("mode", [(1, 0), (2, 0), (3, 0), (5, 0), (7, 0), (6, 0), (4, 4)])
def test_modes_that_lack_what_they_need_are_refused_in_the_air(mode):
    flown = Flown().take_off(3.0)
    assert flown.command(176, 1, *mode) == TEMPORARILY_REJECTED
    assert "is currently not available" in flown.texts[-1]
    assert flown.mode == "HOLD"


@pytest.mark.parametrize("sub", [1, 7, 10])
def test_unsupported_auto_modes_are_refused(sub):
    flown = Flown().boot()
    assert flown.command(176, 1, 4, sub) == TEMPORARILY_REJECTED
    assert flown.texts[-1] == "Unsupported auto mode"


@pytest.mark.parametrize("main", [0, 8, 99, 1e30, NAN])
def test_unknown_main_modes_are_taken_without_effect(main):
    flown = Flown().boot()
    assert flown.command(176, 1, main, 0) == ACCEPTED
    assert flown.mode == "HOLD"


@pytest.mark.parametrize(
    ("base_mode", "shown"), [(4, "MISSION"), (64, "MANUAL"), (64 | 16, "STABILIZED"), (64 | 8, "POSITION"), (8, "HOLD")]
)
def test_programs_that_know_nothing_of_px4_choose_modes_by_flags(base_mode, shown):
    flown = Flown().boot()
    assert flown.command(176, base_mode, 6) == ACCEPTED
    assert flown.mode == shown


def test_the_old_set_mode_message_is_answered_as_a_command():
    from sitl.dialect import mavlink

    flown = Flown().boot()
    flown.send(mavlink.MAVLink_set_mode_message(1, 1, 0x06040000))
    assert flown.run(0.1).last("COMMAND_ACK").command == 176
    assert flown.mode == "LAND"


def test_a_mode_change_shows_within_a_second():
    flown = Flown().take_off(3.0)
    flown.command(21)
    flown.run(1.0)
    assert flown.last("HEARTBEAT").custom_mode == 0x06040000
    assert flown.last("HEARTBEAT").base_mode == 157


def test_a_take_off_ends_in_hold_at_its_height():
    flown = Flown().boot()
    assert flown.command(22, 0, 0, 0, NAN, NAN, NAN, 489.4 + 4.0) == ACCEPTED  # accepted while disarmed
    assert flown.command(400, 1) == ACCEPTED
    flown.until(lambda: "Takeoff detected" in flown.texts, 4.0)
    assert flown.until(lambda: flown.mode == "HOLD", 15.0) > 2.0
    flown.run(6.0)
    assert flown.height == pytest.approx(4.0, abs=0.1)
    assert [m.landed_state for m in flown.messages("EXTENDED_SYS_STATE")][-1] == 2
    assert 3 in [m.landed_state for m in flown.messages("EXTENDED_SYS_STATE")]


def test_a_take_off_without_a_height_takes_the_parameters():
    flown = Flown().boot()
    flown.command(22, 0, 0, 0, NAN, NAN, NAN, NAN)
    flown.command(400, 1)
    flown.run(14.0)
    assert flown.height == pytest.approx(2.5, abs=0.1)


def test_landing_disarms_two_seconds_after_it_is_detected_and_goes_back_to_hold():
    flown = Flown().take_off(3.0)
    flown.command(21)
    flown.until(lambda: "Landing detected" in flown.texts, 30.0)
    assert flown.until(lambda: not flown.armed, 5.0) == pytest.approx(2.0, abs=0.1)
    assert flown.texts[-1] == "Disarmed by landing"
    assert flown.mode == "HOLD"
    assert flown.height == pytest.approx(0.0, abs=0.01)


def test_termination_stops_the_motors_for_good():
    flown = Flown().boot()
    assert flown.command(185, 1) == DENIED  # it is not armed
    flown.take_off(10.0)
    assert flown.command(185, 0) == DENIED
    assert flown.command(185, 1) == ACCEPTED
    flown.run(1.0)
    heartbeat = flown.last("HEARTBEAT")
    assert (heartbeat.custom_mode, heartbeat.base_mode, heartbeat.system_status) == (0x000A0000, 129, 8)
    flown.until(lambda: "Disarmed by lockdown" in flown.texts, 6.0)
    assert flown.command(400, 1) == TEMPORARILY_REJECTED


def test_whoever_is_armed_can_be_terminated_on_the_ground_too():
    flown = Flown().boot()
    flown.command(400, 1)
    assert flown.command(185, 1) == ACCEPTED
    assert flown.run(0.1).mode == "TERMINATION"


def test_texts_go_to_the_ground_and_never_to_the_companion():
    flown = Flown().boot()
    flown.command(400, 1, link=Link.ONBOARD)
    flown.run(0.1)
    assert flown.messages("STATUSTEXT", link=Link.GROUND)
    assert not flown.messages("STATUSTEXT", link=Link.ONBOARD)


def test_texts_wait_while_the_ground_stations_heartbeats_have_stopped():
    from sitl.dialect import mavlink

    heartbeat = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
    flown = Flown().boot()
    flown.send(heartbeat)
    flown.run(4.0)  # silent for longer than it may be
    flown.command(400, 1, link=Link.ONBOARD)
    flown.run(1.0)
    assert flown.texts == []
    flown.send(heartbeat)
    flown.run(0.1)
    assert "Armed by external command" in flown.texts


def test_each_vehicle_of_a_fleet_is_its_own():
    flown = Flown(field(3)).boot()
    assert flown.command(400, 1, sysid=2) == ACCEPTED
    armed = [vehicle.autopilot.armed for vehicle in flown.simulator.vehicles.values()]
    assert armed == [False, True, False]
