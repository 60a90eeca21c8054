"""The sockets of a fleet: two UDP ports per vehicle, one MAVLink message per datagram, paced by the loop's clock."""

import asyncio
import errno
import socket
import sys
from collections.abc import Callable

from sitl.errors import PortInUse
from sitl.fleet import TICK_S
from sitl.link.truth_log import TruthLog
from sitl.microservices.outbox import Link
from sitl.settings import COMPANION_PORT, GCS_PORT, GROUND_PORT, ONBOARD_PORT, Settings
from sitl.simulator import Simulator

SLIP_S = 0.1
"""Farther behind the clock than this, the simulation gives the lost time up instead of racing after it."""
RECEIVE_BUFFER_BYTES = 1 << 20

Address = tuple[str, int]


class _Endpoint(asyncio.DatagramProtocol):
    """One port: hands every datagram to the simulator."""

    def __init__(self, receive: Callable[[bytes], None]) -> None:
        self._receive = receive

    def datagram_received(self, data: bytes, addr: Address) -> None:
        self._receive(data)

    def error_received(self, exc: Exception) -> None:
        """Nobody listens at the other end, which is none of our business."""


class FleetLinks:
    """The open sockets of all vehicles.

    Args:
        simulator: who receives.
        settings: host and instance base.
    """

    def __init__(self, simulator: Simulator, settings: Settings) -> None:
        self._simulator = simulator
        self._settings = settings
        self._transports: dict[tuple[int, Link], asyncio.DatagramTransport] = {}
        self._peers: dict[tuple[int, Link], Address] = {}

    async def open(self) -> None:
        """Bind all ports.

        Raises:
            PortInUse: naming the port.
        """
        try:
            for sysid in self._simulator.vehicles:
                shift = self._settings.instance_base
                await self._open_one(sysid, Link.GROUND, GROUND_PORT + sysid - 1 + shift, GCS_PORT + shift)
                companion_port = COMPANION_PORT + sysid - 1 + shift
                await self._open_one(sysid, Link.ONBOARD, ONBOARD_PORT + sysid - 1 + shift, companion_port)
        except BaseException:
            self.close()
            raise

    def send(self) -> None:
        """Send everything that the simulator has to send."""
        for sysid, link, frame in self._simulator.transmissions():
            key = (sysid, link)
            self._transports[key].sendto(frame, self._peers[key])

    def close(self) -> None:
        for transport in self._transports.values():
            transport.close()

    async def _open_one(self, sysid: int, link: Link, port: int, peer_port: int) -> None:
        def receive(datagram: bytes) -> None:
            self._simulator.receive(sysid, link, datagram)
            self.send()

        host = self._settings.host
        bound = _bind(host, port, f"{link.value} link of vehicle {sysid}")
        loop = asyncio.get_running_loop()
        transport, _ = await loop.create_datagram_endpoint(lambda: _Endpoint(receive), sock=bound)
        self._transports[sysid, link] = transport
        self._peers[sysid, link] = (host, peer_port)


def _bind(host: str, port: int, purpose: str) -> socket.socket:
    bound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    bound.setblocking(False)
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
    try:
        bound.bind((host, port))
    except OSError as problem:
        bound.close()
        if problem.errno == errno.EADDRINUSE:
            raise PortInUse(host, port, purpose) from None
        raise
    return bound


async def run(simulator: Simulator, links: FleetLinks, settings: Settings, log: TruthLog | None) -> None:
    """Advance the simulation at its speed for ever; collisions are reported on standard error."""
    loop = asyncio.get_running_loop()
    interval_s = TICK_S / settings.speed
    due_s = loop.time()
    reported = 0
    while True:
        simulator.step()
        links.send()
        if log is not None:
            log.write(simulator.truth)
        for collision in simulator.collisions[reported:]:
            print(f"sitl: {collision}", file=sys.stderr, flush=True)
        reported = len(simulator.collisions)
        due_s += interval_s
        late_s = loop.time() - due_s
        if late_s > SLIP_S:
            due_s += late_s
        await asyncio.sleep(max(-late_s, 0.0))
