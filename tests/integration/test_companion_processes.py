"""The real companion, over UDP and MAVSDK, with the simulator: flights, hand-overs, deaths."""

import json
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from missions.mission_items import plan_id
from missions.tunnel import CompanionState, Reason
from sitl.dialect import mavlink
from tests.integration.companion_process import (
    COMPANION,
    HOLD,
    INDOOR,
    LAND,
    OFFBOARD,
    TRACK_M,
    FlightDesk,
    running_companion,
)
from tests.integration.sitl_process import free_instance_base, running_sitl

pytestmark = pytest.mark.processes

SPEED = 5.0
STARTUP_S = 120.0
"""On a fresh machine the companion first compiles its planner."""


@pytest.fixture
def base() -> int:
    return free_instance_base()


@pytest.fixture
def desk(base: int) -> Iterator[FlightDesk]:
    """A ground station beside a running simulator."""
    with running_sitl("indoor", "--speed", f"{SPEED:g}", base=base):
        desk = FlightDesk(base)
        yield desk
        desk.close()


def hovering_with_a_mission(desk: FlightDesk) -> None:
    """A companion that is ready, and a vehicle that hovers."""
    desk.until(lambda: desk.state is CompanionState.WAITING, STARTUP_S)
    desk.set_parameter("COM_OBL_RC_ACT", 5)
    items = desk.indoor_items()
    desk.upload(items)
    ready = desk.until(lambda: desk.state is CompanionState.READY and desk.statuses[-1])
    assert (ready.plan_id, ready.mission_digest) == (plan_id(items), INDOOR.digest)
    desk.hover()


def place_m(desk: FlightDesk) -> np.ndarray:
    """(3,) where the autopilot says it is, mission ENU."""
    found = desk.last("GLOBAL_POSITION_INT")
    return INDOOR.frame.enu(found.lat / 1e7, found.lon / 1e7, found.alt / 1e3)


def test_it_flies_the_uploaded_mission_reports_on_it_and_lands_at_the_target(
    desk: FlightDesk, base: int, tmp_path: Path
):
    log = tmp_path / "log.jsonl"
    with running_companion(base, "--log", str(log)) as process:
        hovering_with_a_mission(desk)
        for _ in range(3):
            assert desk.start_mission().result == mavlink.MAV_RESULT_ACCEPTED
        desk.until(lambda: desk.state is CompanionState.FLYING)
        assert desk.until(lambda: desk.mode == OFFBOARD)
        desk.until(lambda: desk.state is CompanionState.FINISHED, 30.0)
        process.send_signal(signal.SIGTERM)
        assert process.wait(10.0) == 0
    last = desk.statuses[-1]
    assert last.reason is Reason.TARGET_REACHED
    assert last.track_index == len(TRACK_M) - 1
    assert last.tracking_error_p99_m < 0.5
    assert last.replans >= 3
    np.testing.assert_allclose(place_m(desk)[:2], TRACK_M[-1, :2], atol=0.4)
    assert desk.last("MISSION_CURRENT").seq == last.track_index + 1
    heartbeats = [m for m in desk.heard if m.get_type() == "HEARTBEAT" and m.get_srcComponent() == 191]
    assert {m.type for m in heartbeats} == {mavlink.MAV_TYPE_ONBOARD_CONTROLLER}
    announced = desk.trajectories
    assert len(announced) == last.replans + 1
    assert abs(announced[0].trajectory.start_s - time.time_ns() / 1e9) < 600.0 * SPEED
    entries = [json.loads(line) for line in log.read_text().splitlines()]
    states = [entry["state"] for entry in entries if entry["event"] == "state"]
    assert states == ["WAITING", "READY", "ENGAGING", "FLYING", "LANDING", "FINISHED"]


def test_hold_ends_its_control_resume_gives_it_back_and_sigterm_leaves_the_vehicle_holding(desk: FlightDesk, base: int):
    with running_companion(base) as process:
        hovering_with_a_mission(desk)
        desk.start_mission()
        desk.until(lambda: desk.state is CompanionState.FLYING)
        desk.until(lambda: place_m(desk)[0] > 3.0)
        desk.set_mode(4, 3)
        released = desk.until(lambda: desk.state is CompanionState.RELEASED and desk.statuses[-1])
        assert released.reason is Reason.CONTROL_TAKEN
        time.sleep(1.0)
        assert (desk.mode, desk.state) == (HOLD, CompanionState.RELEASED)
        held_m = place_m(desk)
        assert desk.start_mission().result == mavlink.MAV_RESULT_ACCEPTED
        desk.until(lambda: desk.state is CompanionState.FLYING)
        desk.until(lambda: place_m(desk)[0] > held_m[0] + 2.0)
        process.send_signal(signal.SIGTERM)
        assert process.wait(10.0) == 0
        desk.until(lambda: desk.mode == HOLD)
        assert desk.last("EXTENDED_SYS_STATE").landed_state == 2


@pytest.mark.parametrize(
    ("fault", "ended_by"), [("companion-kill", signal.SIGKILL), ("companion-hang", signal.SIGALRM)]
)
def test_a_companion_that_dies_or_hangs_leaves_a_vehicle_that_holds(
    desk: FlightDesk, base: int, fault: str, ended_by: signal.Signals
):
    with running_companion(base, "--fault", f"{fault}:vehicle=1,at_s=2") as process:
        hovering_with_a_mission(desk)
        desk.start_mission()
        assert process.wait(20.0) == -ended_by
        died_s, height_m = time.monotonic(), place_m(desk)[2]
        desk.until(lambda: desk.mode in {HOLD, LAND}, 5.0)
        assert time.monotonic() - died_s < 2.5
        assert place_m(desk)[2] > height_m - 0.5


def test_a_new_mission_in_flight_is_flown_without_leaving_offboard(desk: FlightDesk, base: int):
    with running_companion(base):
        hovering_with_a_mission(desk)
        desk.start_mission()
        desk.until(lambda: desk.state is CompanionState.FLYING)
        higher = desk.indoor_items(TRACK_M + np.array([0.0, 0.0, 0.6]))
        desk.upload(higher)
        desk.until(lambda: desk.statuses[-1].plan_id == plan_id(higher))
        assert desk.state is CompanionState.FLYING
        desk.until(lambda: desk.state is CompanionState.LANDING, 20.0)
        flown = [m for m in desk.heard if m.get_type() == "GLOBAL_POSITION_INT"]
        assert max(m.alt for m in flown) / 1e3 - INDOOR.origin.altitude_amsl_m > 1.9


def test_without_a_vehicle_in_the_air_it_refuses_to_start(desk: FlightDesk, base: int):
    with running_companion(base):
        desk.until(lambda: desk.state is CompanionState.WAITING, STARTUP_S)
        desk.upload(desk.indoor_items())
        desk.until(lambda: desk.state is CompanionState.READY)
        refused = desk.start_mission()
        assert refused.result == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
        assert refused.result_param2 == Reason.NOT_AIRBORNE


def test_it_ends_with_its_parent(desk: FlightDesk, base: int):
    with running_companion(base, "--supervised") as process:
        desk.until(lambda: desk.state is CompanionState.WAITING, STARTUP_S)
        process.stdin.close()
        assert process.wait(10.0) == 0


def test_it_ends_while_the_autopilot_owes_it_an_answer(base: int):
    """MAVSDK never answers what is still open when it is destroyed."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as mute, running_companion(base, "--supervised") as process:
        mute.settimeout(0.2)
        codec = mavlink.MAVLink(None, 1, 1)
        until_s = time.monotonic() + STARTUP_S
        asked = False
        while not asked:
            assert time.monotonic() < until_s
            heartbeat = mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3)
            mute.sendto(heartbeat.pack(codec), ("127.0.0.1", 14540 + base))
            with suppress(TimeoutError):
                heard = codec.parse_buffer(mute.recv(65535)) or []
                asked = any(message.get_type() == "COMMAND_LONG" for message in heard)
        process.stdin.close()
        assert process.wait(10.0) == 0


def test_a_port_in_use_is_bad_usage(base: int):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 14540 + base))
        found = subprocess.run(
            [str(COMPANION), "--vehicle", "1", "--mission", "indoor", "--instance-base", str(base)],
            capture_output=True,
            text=True,
            timeout=STARTUP_S,
            check=False,
        )
    assert found.returncode == 2
    assert f"udpin://127.0.0.1:{14540 + base}: address already in use" in found.stderr


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--vehicle", "7", "--mission", "indoor"], "no vehicle with system id 7, it has 1, 2"),
        (["--vehicle", "1", "--mission", "outdoor"], "no such file, and no shipped mission of that name"),
        (["--vehicle", "1", "--mission", "indoor", "--origin", "47,8"], "expected LAT,LON,ALT"),
        (["--vehicle", "1", "--mission", "indoor", "--fault", "companion-kill:vehicle=1"], "at_s"),
        (["--vehicle", "1", "--mission", "indoor", "--log", "/nowhere/log"], "/nowhere/log: cannot be written"),
        (["--vehicle", "1", "--mission", "indoor", "--mode", "cloud"], "cloud"),
        (["--mission", "indoor"], "--vehicle"),
    ],
)
def test_bad_input_is_refused_with_code_2(arguments: list[str], complaint: str):
    found = subprocess.run([str(COMPANION), *arguments], capture_output=True, text=True, timeout=60.0, check=False)
    assert found.returncode == 2
    assert complaint in found.stderr
