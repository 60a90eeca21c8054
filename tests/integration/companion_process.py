"""The `companion` program as a child process, and what a ground station has to do to let it fly."""

import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from missions import tunnel
from missions.mission import load_mission
from missions.mission_items import MissionItem, Track, encode_track
from missions.tunnel import CompanionState, PayloadType
from sitl.dialect import mavlink
from sitl.microservices.mission_item_codec import int_item
from sitl.microservices.outbox import Link, Sender
from tests.integration.sitl_process import GroundStation

COMPANION = Path(sys.executable).with_name("companion")
INDOOR = load_mission("indoor")
TRACK_M = np.array([[4.0, 5.2, 1.5], [7.0, 4.2, 1.5], [10.0, 5.0, 1.5], [14.0, 6.0, 1.5], [19.0, 8.5, 1.5]])
HEARTBEAT_INTERVAL_S = 0.5
COMMAND_REPEAT_S = 1.0


@contextmanager
def running_companion(base: int, *arguments: str, speed: float = 5.0) -> Iterator[subprocess.Popen]:
    """A companion of vehicle 1 of the indoor mission; ended with the block."""
    options = ["--vehicle", "1", "--mission", "indoor", "--speed", f"{speed:g}", "--instance-base", str(base)]
    with subprocess.Popen(
        [str(COMPANION), *options, *arguments], stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            yield process
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
                process.wait(15.0)
            process.stdin.close()
            process.stderr.close()


class FlightDesk(GroundStation):
    """A ground station that can upload a mission, arm, take off and start."""

    def __init__(self, base: int) -> None:
        super().__init__(base)
        self._next_heartbeat_s = 0.0
        self._tunnels_read = 0
        self._statuses: list[tunnel.CompanionStatus] = []
        self._trajectories: list[tunnel.TrajectoryMessage] = []

    def listen(self) -> list[Any]:
        if time.monotonic() >= self._next_heartbeat_s:
            self._next_heartbeat_s = time.monotonic() + HEARTBEAT_INTERVAL_S
            self.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        heard = super().listen()
        self._read_tunnels()
        return heard

    # ---------------------------------------------------------------------- what is heard

    @property
    def statuses(self) -> list[tunnel.CompanionStatus]:
        self.listen()
        return self._statuses

    @property
    def trajectories(self) -> list[tunnel.TrajectoryMessage]:
        self.listen()
        return self._trajectories

    @property
    def state(self) -> CompanionState | None:
        return self.statuses[-1].state if self.statuses else None

    @property
    def mode(self) -> int:
        return self.last("HEARTBEAT", component=1).custom_mode

    def _read_tunnels(self) -> None:
        tunnels = self._by_kind["TUNNEL"]
        for message in tunnels[self._tunnels_read :]:
            payload = bytes(message.payload[: message.payload_length])
            if message.payload_type == PayloadType.COMPANION_STATUS:
                self._statuses.append(tunnel.decode_status(payload))
            elif message.payload_type == PayloadType.TRAJECTORY:
                self._trajectories.append(tunnel.decode_trajectory(payload))
        self._tunnels_read = len(tunnels)

    # -------------------------------------------------------------------- what is commanded

    def command(self, number: int, *params: float, component: int = 1) -> Any:
        """The COMMAND_ACK of a COMMAND_LONG, sent again while there is none.

        A companion hears a ground station from its first heartbeat on.
        """
        before = len(self.of("COMMAND_ACK"))
        values = (*params, *(0.0,) * (7 - len(params)))
        repeat_at_s = 0.0

        def answer() -> Any:
            nonlocal repeat_at_s
            if time.monotonic() >= repeat_at_s:
                repeat_at_s = time.monotonic() + COMMAND_REPEAT_S
                self.send(mavlink.MAVLink_command_long_message(1, component, number, 0, *values))
            found = [m for m in self.of("COMMAND_ACK")[before:] if m.command == number]
            return next((m for m in found if m.get_srcComponent() == component), None)

        return self.until(answer)

    def set_mode(self, main: int, sub: int = 0) -> None:
        assert self.command(mavlink.MAV_CMD_DO_SET_MODE, 1, main, sub).result == 0

    def start_mission(self) -> Any:
        return self.command(mavlink.MAV_CMD_MISSION_START, component=191)

    def set_parameter(self, name: str, value: int) -> None:
        raw = struct.unpack("<f", struct.pack("<i", value))[0]
        self.send(mavlink.MAVLink_param_set_message(1, 1, name.encode(), raw, mavlink.MAV_PARAM_TYPE_INT32))

    def upload(self, items: tuple[MissionItem, ...]) -> None:
        """Store a mission in the autopilot."""
        heard = len(self.listen())
        self.send(mavlink.MAVLink_mission_count_message(1, 1, len(items), 0))
        for seq, item in enumerate(items):
            self.until(lambda seq=seq: [m for m in self._requests(heard) if m.seq == seq])
            self.send(int_item(item, seq, Sender(Link.GROUND, 1, 1), mavlink.MAV_MISSION_TYPE_MISSION))
        ack = self.until(lambda: [m for m in self.listen()[heard:] if m.get_type() == "MISSION_ACK"])
        assert ack[0].type == mavlink.MAV_MISSION_ACCEPTED

    def _requests(self, heard: int) -> list[Any]:
        return [m for m in self.listen()[heard:] if m.get_type() in {"MISSION_REQUEST_INT", "MISSION_REQUEST"}]

    def indoor_items(self, points_m: np.ndarray = TRACK_M) -> tuple[MissionItem, ...]:
        """A track as mission items, with the ground offset that the vehicle has now."""
        home = self.until(lambda: self.last("HOME_POSITION"))
        offset_m = home.altitude / 1e3 - INDOOR.origin.altitude_amsl_m
        track = Track(points_m, np.full(len(points_m), 3.0))
        return encode_track(track, INDOOR.frame, acceptance_radius_m=0.3, ground_offset_m=offset_m)

    def hover(self) -> None:
        """Arm, take off, and wait until the vehicle holds its height."""
        self.until(lambda: self.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1).result == 0, 20.0)
        altitude_m = INDOOR.origin.altitude_amsl_m + INDOOR.takeoff_height_m
        self.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, float("nan"), float("nan"), altitude_m)
        self.until(lambda: self.mode == HOLD and self.last("EXTENDED_SYS_STATE").landed_state == IN_AIR, 20.0)


HOLD, OFFBOARD, LAND = 0x03040000, 0x00060000, 0x06040000
IN_AIR = 2
