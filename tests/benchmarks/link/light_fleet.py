"""Many vehicles as a ground station sees them, without the physics: telemetry stamped with this machine's clock, and
the simulator's own mission server, each 50 ms late. So the ground station is measured, not how fast a simulator flies.

`python -m tests.benchmarks.link.light_fleet VEHICLES FIRST_PORT GCS_PORT LOSS` runs until its standard input is closed.
"""

import asyncio
import random
import socket
import sys
from typing import Any

from gcs.dialect import AUTOPILOT
from sitl.microservices.mission_transfer_server import MissionTransferServer
from sitl.microservices.outbox import Link, Outbox
from sitl.wire import LAYOUTS, FrameReader, FrameWriter
from tests.benchmarks.link.conditions import ONE_WAY_DELAY_S
from tests.benchmarks.link.conversation import SERVER_TICK_S, Shelf, serve

TICK_S = 0.1
"""State comes at 10 Hz."""
SLOWER = (("VFR_HUD", 3), ("SYS_STATUS", 5), ("EXTENDED_SYS_STATE", 2), ("MISSION_CURRENT", 2), ("HEARTBEAT", 10))
"""Message -> sent every so many ticks."""
TWICE = ("ATTITUDE", "LOCAL_POSITION_NED")
"""Sent besides, at 10 Hz: what an autopilot sends without being asked."""


class LightVehicle:
    """One vehicle behind one socket; a share of the frames gets lost, both ways."""

    def __init__(self, sysid: int, port: int, gcs_port: int, loss: float) -> None:
        self._loss, self._rng = loss, random.Random(sysid)
        self._gcs = ("127.0.0.1", gcs_port)
        self._loop = asyncio.get_running_loop()
        self._writer, self._outbox, self._reader = FrameWriter(sysid, AUTOPILOT), Outbox(sysid), FrameReader()
        store: Any = Shelf()
        nobody: Any = None
        self._server = MissionTransferServer(Link.GROUND, store, nobody, self._outbox, lambda *said: None, 1.0)
        self._end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._end.setblocking(False)
        self._end.bind(("127.0.0.1", port))
        self._loop.add_reader(self._end, self._receive)
        self._ticks = sysid  # not all in the same one

    def tell(self) -> None:
        """The telemetry of one tick; positions carry the time at which they are made."""
        self._ticks += 1
        now_ms = round(self._loop.time() * 1e3) & 0xFFFFFFFF
        self._send("GLOBAL_POSITION_INT", (now_ms, 473977418, 85455939, 490000, 1000, 10, 20, 0, 9000))
        self._send("ATTITUDE_QUATERNION", (now_ms, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, [0.0] * 4))
        for name in TWICE:
            self._send(name, (now_ms, *(0.1,) * 6))
        for name, every in SLOWER:
            if self._ticks % every == 0:
                self._send(name, _VALUES[name])

    def tick(self) -> None:
        """The mission server's own repetitions."""
        self._server.tick(self._loop.time())
        self._answer()

    def _receive(self) -> None:
        while True:
            try:
                datagram = self._end.recv(2048)
            except OSError:
                return
            if self._rng.random() >= self._loss:
                self._loop.call_later(ONE_WAY_DELAY_S, self._serve, datagram)

    def _serve(self, datagram: bytes) -> None:
        for message in self._reader.read(datagram):
            serve(self._server, message, self._loop.time())
        self._answer()

    def _answer(self) -> None:
        for _, frame in self._outbox.take():
            if self._rng.random() >= self._loss:
                self._loop.call_later(ONE_WAY_DELAY_S, self._end.sendto, frame, self._gcs)

    def _send(self, name: str, values: tuple[Any, ...]) -> None:
        frame = self._writer.frame(LAYOUTS[name], values)
        if self._rng.random() >= self._loss:
            self._end.sendto(frame, self._gcs)


_VALUES: dict[str, tuple[Any, ...]] = {
    "VFR_HUD": (1.0, 1.0, 90, 50, 490.0, 0.0),
    "SYS_STATUS": (0, 0, 0x10000000, 180, 16000, -1, 90, 0, 0, 0, 0, 0, 0, 0, 0, 0),
    "EXTENDED_SYS_STATE": (0, 1),
    "MISSION_CURRENT": (0, 0, 0, 0, 0, 0, 0),
    "HEARTBEAT": (2, 12, 81, 0x03040000, 3, 3),
}


async def run(n_vehicles: int, first_port: int, gcs_port: int, loss: float) -> None:
    """Send and serve until cancelled."""
    vehicles = [LightVehicle(i + 1, first_port + i, gcs_port, loss) for i in range(n_vehicles)]
    print("ready", flush=True)
    loop = asyncio.get_running_loop()
    due_s, ticks = loop.time(), 0
    per_tick = round(TICK_S / SERVER_TICK_S)
    while True:
        for vehicle in vehicles[ticks % per_tick :: per_tick]:  # spread over the tick, as real ones are
            vehicle.tell()
        for vehicle in vehicles:
            vehicle.tick()
        ticks += 1
        due_s += SERVER_TICK_S
        await asyncio.sleep(max(due_s - loop.time(), 0.0))


async def main() -> None:
    """Run until standard input is closed."""
    n_vehicles, first_port, gcs_port = (int(argument) for argument in sys.argv[1:4])
    running = asyncio.create_task(run(n_vehicles, first_port, gcs_port, float(sys.argv[4])))
    await asyncio.to_thread(sys.stdin.read)
    running.cancel()


if __name__ == "__main__":
    asyncio.run(main())
