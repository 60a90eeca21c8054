"""The companion's side of its link, MAVSDK and all, against a scripted autopilot on a UDP socket."""

import asyncio
import socket
from collections.abc import Iterator

import pytest
from pymavlink.dialects.v20 import common as mavlink

from companion.events import AutopilotFound, AutopilotLost
from companion.link.px4 import Px4

pytestmark = pytest.mark.processes

SYSID = 2
VEHICLE, GROUND_STATION = mavlink.MAVLink(None, SYSID, 1), mavlink.MAVLink(None, 255, 190)
VEHICLE_HEARTBEAT = mavlink.MAVLink_heartbeat_message(
    mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_PX4, 81, 0, mavlink.MAV_STATE_STANDBY, 3
)
GROUND_HEARTBEAT = mavlink.MAVLink_heartbeat_message(
    mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, 3
)
MEETING_S = 3.0
LOSING_S = 8.0
"""MAVSDK gives a system up after three seconds of silence."""


@pytest.fixture
def port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def wire(port: int) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as wire:
        wire.connect(("127.0.0.1", port))
        yield wire


async def heard(autopilot: Px4, kind: type, within_s: float) -> None:
    async with asyncio.timeout(within_s):
        while not isinstance(await autopilot.receive(), kind):
            pass


async def test_an_autopilot_is_found_lost_and_found_again_whatever_it_says_before_its_heartbeat(
    wire: socket.socket, port: int
):
    autopilot = Px4(SYSID, f"udpin://127.0.0.1:{port}", complain=lambda text: None)
    await autopilot.open()
    try:
        wire.send(mavlink.MAVLink_system_time_message(1, 1).pack(VEHICLE))
        wire.send(GROUND_HEARTBEAT.pack(GROUND_STATION))
        with pytest.raises(TimeoutError):  # a system that MAVSDK knows, and that is not there yet
            await heard(autopilot, AutopilotFound, within_s=1.0)
        for _ in range(2):
            wire.send(VEHICLE_HEARTBEAT.pack(VEHICLE))
            await heard(autopilot, AutopilotFound, MEETING_S)
            await heard(autopilot, AutopilotLost, LOSING_S)
    finally:
        autopilot.close()
