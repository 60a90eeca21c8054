"""The `sitl` program with many vehicles: its CPU time, memory and pace while all their telemetry is received."""

import os
import selectors
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sitl.dialect import Message, mavlink
from sitl.settings import GCS_PORT, GROUND_PORT

INSTANCE_BASE = 12_000
"""Below the ports that the kernel gives out by itself."""
ONBOARD_PORT, COMPANION_PORT = 17_000, 16_000
"""The usual ones leave no room for a hundred companions."""
LISTENING_PAUSE_S = 0.02
HEARTBEAT_INTERVAL_S = 1.0
STARTING_S, CLIMBING_S, WINDOW_S = 2.0, 8.0, 4.0
RECEIVE_BUFFER_BYTES = 1 << 22
NAN = float("nan")


@dataclass(frozen=True)
class Window:
    """What one stretch of time has cost."""

    cpu_s: float
    wall_s: float
    simulated_s: float
    messages: float
    """Received on both links of all vehicles."""


@dataclass(frozen=True)
class Memory:
    """Of a process."""

    resident_mb: float
    """All of it, libraries' code included."""
    own_mb: float
    """What no file holds: the process's data."""


class Listener:
    """A ground station's and all companions' sockets, which take in everything and note how far each vehicle is."""

    def __init__(self, n_vehicles: int) -> None:
        self._n = n_vehicles
        self._codec = mavlink.MAVLink(None, 255, 190)
        self._selector = selectors.DefaultSelector()
        self._ground = self._bind(GCS_PORT)
        for i in range(n_vehicles):
            self._bind(COMPANION_PORT + i)
        self._heartbeat_due_s = 0.0
        self.messages = 0
        self.simulated_s = 0.0
        """Vehicle time of the newest ATTITUDE of vehicle 1, 50 times a second on board; all have one clock."""
        self._height_m: dict[int, float] = {}

    def close(self) -> None:
        for key in list(self._selector.get_map().values()):
            key.fileobj.close()  # pyright: ignore[reportAttributeAccessIssue]
        self._selector.close()

    @property
    def lowest_m(self) -> float:
        """Height of the lowest vehicle; 0 until all have been heard."""
        return min(self._height_m.values()) if len(self._height_m) == self._n else 0.0

    def send(self, sysid: int, message: Message) -> None:
        port = GROUND_PORT + INSTANCE_BASE + sysid - 1
        self._ground.sendto(message.pack(self._codec), ("127.0.0.1", port))

    def listen(self, duration_s: float) -> None:
        """Take in what comes, with a ground station's heartbeats to all vehicles."""
        end_s = time.monotonic() + duration_s
        while (now_s := time.monotonic()) < end_s:
            if now_s >= self._heartbeat_due_s:
                self._heartbeat_due_s = now_s + HEARTBEAT_INTERVAL_S
                for sysid in range(1, self._n + 1):
                    self.send(sysid, mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
            for key, _ in self._selector.select(0.0):
                self._take_in(key.fileobj)  # pyright: ignore[reportArgumentType]
            time.sleep(LISTENING_PAUSE_S)

    def _take_in(self, end: socket.socket) -> None:
        while True:
            try:
                frame = end.recv(512)
            except BlockingIOError:
                return
            self.messages += 1
            kind, sysid = int.from_bytes(frame[7:10], "little"), frame[5]
            if kind == mavlink.MAVLINK_MSG_ID_ATTITUDE and sysid == 1:
                self.simulated_s = self._decoded(frame).time_boot_ms * 1e-3
            elif kind == mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED and end is self._ground:
                self._height_m[sysid] = -self._decoded(frame).z

    def _decoded(self, frame: bytes) -> Any:
        return self._codec.decode(bytearray(frame))

    def _bind(self, port: int) -> socket.socket:
        end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        end.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        end.setblocking(False)
        end.bind(("127.0.0.1", port + INSTANCE_BASE))
        self._selector.register(end, selectors.EVENT_READ)
        return end


class FleetRun:
    """A running `sitl` with its listener.

    Args:
        process: the program, which has said that it is ready.
        listener: the other end of all its links.
        ready_after_s: wall-clock time from the start of the process to that.
    """

    def __init__(self, process: subprocess.Popen[str], listener: Listener, ready_after_s: float) -> None:
        self._pid = process.pid
        self.listener = listener
        self.ready_after_s = ready_after_s

    @property
    def memory(self) -> Memory:
        """What the process occupies now."""
        rollup = Path(f"/proc/{self._pid}/smaps_rollup").read_text().splitlines()[1:]
        kilobytes = {line.split(":")[0]: int(line.split()[1]) for line in rollup}
        return Memory(resident_mb=kilobytes["Rss"] * 1024e-6, own_mb=kilobytes["Anonymous"] * 1024e-6)

    def measure(self) -> Window:
        """What the next seconds cost."""
        before = self._now()
        self.listener.listen(WINDOW_S)
        return Window(*(b - a for a, b in zip(before, self._now(), strict=True)))

    def take_off(self, n_vehicles: int) -> None:
        """Arm everybody and let them climb to their take-off height.

        Raises:
            RuntimeError: somebody has stayed on the ground.
        """
        for sysid in range(1, n_vehicles + 1):
            self.listener.send(sysid, mavlink.MAVLink_command_long_message(sysid, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))
            takeoff = mavlink.MAVLink_command_long_message(sysid, 1, 22, 0, NAN, 0, 0, NAN, NAN, NAN, NAN)
            self.listener.send(sysid, takeoff)
        target_s = self.listener.simulated_s + CLIMBING_S
        while self.listener.simulated_s < target_s:
            self.listener.listen(0.5)
        if self.listener.lowest_m < 1.0:
            raise RuntimeError(f"all should be above 1 m by now, and one is at {self.listener.lowest_m:.1f} m")

    def _now(self) -> tuple[float, ...]:
        """What a `Window` is the difference of."""
        ran_ns = int(Path(f"/proc/{self._pid}/schedstat").read_text().split()[0])
        return ran_ns * 1e-9, time.monotonic(), self.listener.simulated_s, float(self.listener.messages)


@contextmanager
def running_fleet(n_vehicles: int) -> Iterator[FleetRun]:
    """The program at real time on open ground, on one core from when it is ready; ended with the block.

    Raises:
        RuntimeError: it does not start.
    """
    listener = Listener(n_vehicles)
    ports = ["--instance-base", str(INSTANCE_BASE), "--onboard-ports", f"{ONBOARD_PORT}:{COMPANION_PORT}"]
    command = [sys.executable, "-m", "sitl", "--vehicles", str(n_vehicles), *ports, "--supervised"]
    begun_s = time.monotonic()
    try:
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdin is not None
            assert process.stdout is not None
            line = process.stdout.readline()
            if not line.startswith("sitl: ready"):
                raise RuntimeError(f"expected the simulator to be ready, it said {line!r}")
            ready_after_s = time.monotonic() - begun_s
            os.sched_setaffinity(process.pid, {max(os.sched_getaffinity(0))})
            listener.listen(STARTING_S)
            yield FleetRun(process, listener, ready_after_s)
            process.stdin.close()
            process.wait(10.0)
    finally:
        listener.close()
