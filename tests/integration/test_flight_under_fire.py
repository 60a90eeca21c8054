"""A flight whose vehicles sign, while somebody else floods the ground station's port with forged frames and garbage."""

import os
import random
import socket
import subprocess
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from gcs.dialect import mavlink
from tests.integration import programs

PAUSE_S = 0.004
"""Between two datagrams: 250 a second, as many as the vehicles send."""


def forged() -> Iterator[bytes]:
    """Yield, in the names of both vehicles and unsigned, what would end a flight if it were believed; and garbage."""
    chance = random.Random(1)
    lies = (
        mavlink.MAVLink_heartbeat_message(2, 12, 1, 0x06040000, 5, 3),
        mavlink.MAVLink_global_position_int_message(2**32 - 1, 0, 0, -(2**31), -(2**31), 32767, 32767, 32767, 0),
        mavlink.MAVLink_extended_sys_state_message(0, 1),
        mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_MISSION_START, mavlink.MAV_RESULT_DENIED),
        mavlink.MAVLink_mission_ack_message(255, 190, mavlink.MAV_MISSION_DENIED, 0),
        mavlink.MAVLink_mission_current_message(65535),
        mavlink.MAVLink_statustext_message(0, b"\x1b[2JMotor failure"),
        mavlink.MAVLink_timesync_message(1, 1),
    )
    while True:
        for lie in lies:
            for sysid in (1, 2, chance.randrange(3, 250)):
                sender = mavlink.MAVLink(None, sysid, 1)
                sender.seq = chance.randrange(256)
                yield bytes(lie.pack(sender, force_mavlink1=chance.random() < 0.1))
        yield os.urandom(chance.randrange(2000))
        yield b""


def fire(port: int, over: threading.Event) -> int:
    """Send until it is over; how many datagrams."""
    sent = 0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
        for datagram in forged():
            if over.wait(PAUSE_S):
                return sent
            end.sendto(datagram, ("127.0.0.1", port))
            sent += 1
    return sent


@pytest.mark.processes
def test_forged_frames_and_floods_do_not_change_a_flight_whose_vehicles_sign(tmp_path: Path):
    base = programs.instance_base()
    over, sent = threading.Event(), []
    gun = threading.Thread(target=lambda: sent.append(fire(14550 + base, over)))
    gun.start()
    try:
        finished = programs.fly(tmp_path, "--mode", "cloud", "--speed", "3")
    except subprocess.TimeoutExpired as late:
        finished = programs.Finished(-1, str(late))
    finally:
        over.set()
        gun.join()
    assert finished.code == 0, finished.output
    assert sent[0] > 1000
    assert programs.report_of(tmp_path)["success"]
    assert "frames were dropped in its name: what came is not signed" in finished.output
    ours = [line for line in finished.output.splitlines() if "alpha" in line or "bravo" in line]
    assert not any("Motor failure" in line for line in ours)
    assert "\x1b" not in finished.output
    assert "Traceback" not in finished.output
