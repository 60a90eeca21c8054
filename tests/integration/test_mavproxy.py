"""MAVProxy, an implementation of its own, takes the simulator for a PX4: an operator's session, part by part.

One vehicle serves all: every part begins with it on the ground, disarmed, in Hold. MAVProxy's own `mode`, `velocity`
and `position` are of no use with a PX4 (docs/compatibility.md); what an operator types instead is what stands here.
"""

import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from pymavlink import mavutil

from tests.integration.mavproxy_session import MavproxySession, running_mavproxy
from tests.integration.sitl_process import free_instance_base, running_sitl

pytestmark = [pytest.mark.processes, pytest.mark.slow]

HOME = "47.3977432\t8.5455942"
NORTH_10_M = "47.3978332\t8.5455942"
MISSION = f"""QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t{HOME}\t489.4\t1
1\t0\t3\t22\t0\t0\t0\t0\t{HOME}\t4\t1
2\t0\t3\t16\t0\t0\t0\t0\t{NORTH_10_M}\t4\t1
3\t0\t3\t21\t0\t0\t0\t0\t{NORTH_10_M}\t0\t1
"""
FENCE = """QGC WPL 110
0\t0\t3\t5001\t4\t0\t0\t0\t47.3976\t8.5453\t0\t1
1\t0\t3\t5001\t4\t0\t0\t0\t47.3976\t8.5459\t0\t1
2\t0\t3\t5001\t4\t0\t0\t0\t47.3985\t8.5459\t0\t1
3\t0\t3\t5001\t4\t0\t0\t0\t47.3985\t8.5453\t0\t1
"""
RALLY = f"QGC WPL 110\n0\t0\t3\t5100\t0\t0\t0\t0\t{NORTH_10_M}\t10\t1\n"
SETPOINT = "repeat add 0.1 message SET_POSITION_TARGET_LOCAL_NED 0 1 1 1"
HOLD, OFFBOARD, LAND = "long DO_SET_MODE 1 4 3", "long DO_SET_MODE 1 6", "long NAV_LAND"
IN_HOLD, IN_OFFBOARD, IN_RTL, IN_LAND = 0x03040000, 0x00060000, 0x05040000, 0x06040000
IN_POSITION = 0x00030000


@pytest.fixture(scope="module")
def session(tmp_path_factory) -> Iterator[MavproxySession]:
    folder: Path = tmp_path_factory.mktemp("mavproxy")
    for name, content in (("plan.txt", MISSION), ("fence.txt", FENCE), ("rally.txt", RALLY)):
        (folder / name).write_text(content)
    base = free_instance_base()
    with running_sitl("--vehicles", "1", "--speed", "8", base=base), running_mavproxy(14550 + base, folder) as session:
        session.answer(r"Detected vehicle 1:1", 20.0)
        session.answer(r"Received \d+ parameters", 20.0)
        yield session


@pytest.fixture
def mavproxy(session) -> Iterator[MavproxySession]:
    yield session
    session.type("repeat clean")
    if int(session.value("HEARTBEAT", "base_mode")) & 128:
        session.ask(LAND, r"Got COMMAND_ACK: NAV_LAND: ACCEPTED")
        session.until("HEARTBEAT", "base_mode", 0, 127)
    session.ask(HOLD, r"DO_SET_MODE: ACCEPTED")
    in_mode(session, IN_HOLD)


def in_mode(mavproxy: MavproxySession, custom_mode: int) -> None:
    """Wait for it; MAVProxy itself does not announce every change."""
    mavproxy.until("HEARTBEAT", "custom_mode", custom_mode, custom_mode)


def take_off(mavproxy: MavproxySession) -> None:
    """To 5 m; PX4 reads the altitude as AMSL."""
    mavproxy.ask("arm throttle", r"COMPONENT_ARM_DISARM: ACCEPTED")
    mavproxy.ask("takeoff 494.4", r"NAV_TAKEOFF: ACCEPTED")
    mavproxy.until("GLOBAL_POSITION_INT", "relative_alt", 4500, 5500)
    in_mode(mavproxy, IN_HOLD)


def go_offboard(mavproxy: MavproxySession) -> None:
    """As soon as the autopilot has the setpoints that MAVProxy has been told to repeat."""
    deadline_s = time.monotonic() + 10.0
    while mavproxy.ask(OFFBOARD, r"DO_SET_MODE: (\w+)")[1] != "ACCEPTED":
        assert time.monotonic() < deadline_s, "Offboard is still refused"
        time.sleep(0.1)
    in_mode(mavproxy, IN_OFFBOARD)


def set_parameter(mavproxy: MavproxySession, name: str, value: float) -> None:
    """And read it back from the vehicle; MAVProxy sends the setting in its own time."""
    mavproxy.type(f"param set {name} {value}")
    deadline_s = time.monotonic() + 10.0
    while float(mavproxy.ask(f"param fetch {name}", rf"{name} = (-?[\d.]+)")[1]) != value:
        assert time.monotonic() < deadline_s, f"{name} has not become {value}"


def test_it_connects_and_shows_what_the_vehicle_says(mavproxy):
    assert mavproxy.value("SYS_STATUS", "battery_remaining") == 100
    assert mavproxy.value("GPS_RAW_INT", "fix_type") == 3
    assert mavproxy.value("GLOBAL_POSITION_INT", "lat") == pytest.approx(473977432, abs=100)
    assert mavproxy.value("HEARTBEAT", "autopilot") == 12
    mavproxy.ask("alt", r"Altitude:\s+-?0\.")
    mavproxy.ask("long REQUEST_MESSAGE 148", r"REQUEST_MESSAGE: ACCEPTED")
    mavproxy.until("AUTOPILOT_VERSION", "flight_sw_version", 0x01100040, 0x01100040)


def test_parameters_are_listed_set_and_fetched(mavproxy):
    mavproxy.ask("param show MPC_XY_CRUISE", r"MPC_XY_CRUISE\s+5\.0")
    set_parameter(mavproxy, "MPC_XY_CRUISE", 3.5)
    set_parameter(mavproxy, "COM_OBL_RC_ACT", 5)
    set_parameter(mavproxy, "COM_OBL_RC_ACT", 0)


def test_it_arms_takes_off_goes_somewhere_and_lands(mavproxy):
    take_off(mavproxy)
    mavproxy.ask("setspeed 4", r"DO_CHANGE_SPEED: ACCEPTED")
    mavproxy.ask("guided 47.3978332 8.5455942 496.4", r"DO_REPOSITION: ACCEPTED")
    mavproxy.until("GLOBAL_POSITION_INT", "lat", 473978282, 473978382)
    mavproxy.until("GLOBAL_POSITION_INT", "relative_alt", 6500, 7500)
    mavproxy.ask("long NAV_RETURN_TO_LAUNCH", r"NAV_RETURN_TO_LAUNCH: ACCEPTED")
    in_mode(mavproxy, IN_RTL)
    mavproxy.ask(LAND, r"NAV_LAND: ACCEPTED")
    in_mode(mavproxy, IN_LAND)
    mavproxy.answer(r"AP: Landing detected[\s\S]*DISARMED", 20.0)


def test_a_mission_is_loaded_listed_flown_and_cleared(mavproxy):
    mavproxy.ask("wp load plan.txt", r"Sent all 4 waypoints[\s\S]*TYPE_MISSION: ACCEPTED")
    mavproxy.ask("wp list", r"22 \d 47\.3977432\d* 8\.5455942\d* 4\.0+[\s\S]*\n21 \d 47\.3978332")
    mavproxy.ask("arm throttle", r"COMPONENT_ARM_DISARM: ACCEPTED")
    mavproxy.ask("long MISSION_START", r"MISSION_START: ACCEPTED")
    mavproxy.answer(r"waypoint 2[\s\S]*waypoint 3[\s\S]*Mission finished, landed[\s\S]*DISARMED", 30.0)
    assert mavproxy.value("GLOBAL_POSITION_INT", "lat") == pytest.approx(473978332, abs=100)
    mavproxy.ask("wp clear", r"TYPE_MISSION: ACCEPTED")
    mavproxy.ask("long MISSION_START", r"MISSION_START: DENIED")


def test_rally_points_are_loaded_listed_and_cleared(mavproxy):
    mavproxy.ask("rally load rally.txt", r"Sent all 1 rally items[\s\S]*TYPE_RALLY: ACCEPTED")
    mavproxy.ask("rally list", r"5100 \d 47\.3978332\d* 8\.5455942\d* 10\.0")
    mavproxy.ask("rally clear", r"TYPE_RALLY: ACCEPTED")


def test_offboard_flies_positions_and_velocities(mavproxy):
    take_off(mavproxy)
    there = round(mavproxy.value("LOCAL_POSITION_NED", "x") + 3.0, 1)
    mavproxy.type(f"{SETPOINT} 0xDF8 {there} 0 -5 0 0 0 0 0 0 0 0")
    go_offboard(mavproxy)
    mavproxy.until("LOCAL_POSITION_NED", "x", there - 0.5, there + 0.5)
    mavproxy.type("repeat clean")
    mavproxy.type(f"{SETPOINT} 0xDC7 0 0 0 0 1 0 0 0 0 0 0")
    mavproxy.until("LOCAL_POSITION_NED", "vy", 0.7, 1.3)
    mavproxy.ask(HOLD, r"DO_SET_MODE: ACCEPTED")
    in_mode(mavproxy, IN_HOLD)


def test_offboard_flies_attitudes(mavproxy):
    take_off(mavproxy)
    mavproxy.type("repeat add 0.1 attitude 0.9962 0 -0.0872 0 0.6")
    go_offboard(mavproxy)
    mavproxy.until("ATTITUDE", "pitch", -0.21, -0.14)
    mavproxy.ask(HOLD, r"DO_SET_MODE: ACCEPTED")
    in_mode(mavproxy, IN_HOLD)


def test_setpoints_that_stop_are_a_failsafe(mavproxy):
    set_parameter(mavproxy, "COM_OBL_RC_ACT", 3)
    take_off(mavproxy)
    mavproxy.type(f"{SETPOINT} 0xDC7 0 0 0 0 0 0 0 0 0 0 0")
    go_offboard(mavproxy)
    mavproxy.ask("repeat clean", r"AP: Failsafe activated[\s\S]*AP: RTL: ")
    set_parameter(mavproxy, "COM_OBL_RC_ACT", 0)


def test_sticks_fly_position_control(mavproxy):
    take_off(mavproxy)
    mavproxy.type("repeat add 0.05 message MANUAL_CONTROL 1 500 0 500 0 0")
    deadline_s = time.monotonic() + 10.0
    while mavproxy.ask("long DO_SET_MODE 1 3", r"DO_SET_MODE: (\w+)")[1] != "ACCEPTED":
        assert time.monotonic() < deadline_s, "Position is still refused"
        time.sleep(0.1)
    in_mode(mavproxy, IN_POSITION)
    mavproxy.until("VFR_HUD", "groundspeed", 1.0, 5.0)
    mavproxy.type("repeat clean")
    mavproxy.ask(HOLD, r"DO_SET_MODE: ACCEPTED")


def test_a_geofence_is_loaded_listed_and_kept(mavproxy):
    mavproxy.ask("fence load fence.txt", r"Sent all 4 fence items[\s\S]*TYPE_FENCE: ACCEPTED")
    mavproxy.ask("fence list", r"5001 \d 47\.3976\d* 8\.545[\s\S]*\n5001 \d 47\.3985\d* 8\.545")
    take_off(mavproxy)
    mavproxy.type(f"{SETPOINT} 0xDC7 0 0 0 0 5 0 0 0 0 0 0")
    go_offboard(mavproxy)
    mavproxy.answer(r"Geofence violation", 20.0)
    in_mode(mavproxy, IN_HOLD)
    mavproxy.type("repeat clean")
    mavproxy.ask("fence clear", r"TYPE_FENCE: ACCEPTED")


def test_orders_that_a_px4_does_not_take_are_refused_in_words(mavproxy):
    mavproxy.ask("long 31000", r": UNSUPPORTED")
    mavproxy.ask("setyaw 90 10 0", r"CONDITION_YAW: UNSUPPORTED")
    mavproxy.ask(OFFBOARD, r"DO_SET_MODE: ACCEPTED")
    mavproxy.ask("arm throttle", r"COMPONENT_ARM_DISARM: TEMPORARILY_REJECTED[\s\S]*Arming denied")
    mavproxy.ask(HOLD, r"DO_SET_MODE: ACCEPTED")
    mavproxy.ask("velocity 1 0 0", r"force not supported")


def test_parameters_are_saved_compared_and_loaded(mavproxy):
    set_parameter(mavproxy, "MPC_XY_CRUISE", 5.0)
    mavproxy.ask("param save all.parm", r"Saved \d+ parameters")
    set_parameter(mavproxy, "MPC_XY_CRUISE", 4.0)
    mavproxy.ask("param diff all.parm", r"MPC_XY_CRUISE\s+4\.0+\s+5\.0")
    mavproxy.ask("param load all.parm", r"\(changed 1\)")
    mavproxy.ask("param fetch MPC_XY_CRUISE", r"MPC_XY_CRUISE = 5\.0")


def test_a_mission_is_edited(mavproxy):
    mavproxy.ask("wp load plan.txt", r"TYPE_MISSION: ACCEPTED")
    mavproxy.ask("wp list", r"Saved waypoints")
    mavproxy.ask("wp remove 2", r"Sent all 3 waypoints[\s\S]*TYPE_MISSION: ACCEPTED")
    mavproxy.ask("wp list", r"Requesting 3 waypoints[\s\S]*Saved waypoints")
    mavproxy.ask("wp undo", r"Sent all 4 waypoints[\s\S]*TYPE_MISSION: ACCEPTED")
    mavproxy.ask("wp clear", r"TYPE_MISSION: ACCEPTED")


def test_a_reboot_is_followed_by_the_same_session(mavproxy):
    mavproxy.ask("reboot", r"PREFLIGHT_REBOOT_SHUTDOWN: ACCEPTED")
    mavproxy.until("ATTITUDE", "time_boot_ms", 600, 20_000)
    mavproxy.ask("param fetch MPC_XY_CRUISE", r"MPC_XY_CRUISE = \d")


def test_its_recording_can_be_read_again(mavproxy):
    (path,) = mavproxy.folder.rglob("*.tlog")
    mavproxy.ask("long REQUEST_MESSAGE 148", r"REQUEST_MESSAGE: ACCEPTED")
    recording = mavutil.mavlink_connection(str(path), dialect="development")
    kinds = Counter(message.get_type() for message in iter(recording.recv_match, None))
    recording.close()
    assert kinds["BAD_DATA"] == 0
    assert min(kinds["HEARTBEAT"], kinds["ATTITUDE"], kinds["PARAM_VALUE"], kinds["COMMAND_ACK"]) > 0


def test_signing_is_set_up_and_the_link_goes_on(mavproxy):
    """Last: what is signed from here on stays so."""
    mavproxy.ask("signing setup a phrase", r"Setup signing key")
    mavproxy.ask("param fetch MPC_XY_CRUISE", r"MPC_XY_CRUISE = \d")
    assert int(mavproxy.value("HEARTBEAT", "base_mode")) & 128 == 0
