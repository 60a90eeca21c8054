"""The sockets of a fleet: two UDP ports per vehicle, one for the companions' radio; paced by the loop's clock."""

import asyncio
import contextlib
import errno
import socket
import sys
from typing import NamedTuple

from missions.lidar_packets import FIRST_PORT
from missions.ports import FIRST_FLEET_PORT, RADIO_PORT, fleet_port, onboard_port
from sitl.errors import PortInUse
from sitl.fleet import TICK_S
from sitl.link.memory_files import MemoryFiles
from sitl.link.truth_log import TruthLog
from sitl.microservices.outbox import Link
from sitl.settings import GCS_PORT, GROUND_PORT, Settings
from sitl.simulator import Simulator

SLIP_S = 0.1
"""Farther behind the clock than this, the simulation gives the lost time up instead of racing after it."""
RECEIVE_BUFFER_BYTES = 1 << 20
LARGEST_DATAGRAM_BYTES = 65536
MOST_AT_ONCE = 64
"""Datagrams of one port that are taken in before the others have their turn."""

Address = tuple[str, int]
End = tuple[socket.socket, Address | None]


class _Port(NamedTuple):
    """Where one link of one vehicle is bound, and who is at its other end."""

    sysid: int
    link: Link
    own: int
    peer: int | None


class FleetLinks:
    """The open sockets of all vehicles.

    Args:
        simulator: who receives.
        settings: host and instance base.
    """

    def __init__(self, simulator: Simulator, settings: Settings) -> None:
        self._simulator = simulator
        self._settings = settings
        self._ends: dict[bool, dict[int, End]] = {True: {}, False: {}}
        """Is it the ground link -> system id -> socket and peer."""
        self._lidar: socket.socket | None = None
        self._radio: socket.socket | None = None

    def open(self) -> None:
        """Bind all ports, and receive on them in the running event loop.

        Raises:
            PortInUse: naming the port.
        """
        try:
            self._lidar = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._lidar.setblocking(False)
            shift = self._settings.instance_base
            self._radio = bind(self._settings.host, RADIO_PORT + shift, "fleet radio")
            asyncio.get_running_loop().add_reader(self._radio, self._receive_radio, self._radio)
            for port in self._ports():
                self._open_one(port)
        except BaseException:
            self.close()
            raise

    def send(self) -> None:
        """Send everything that the simulator has to send; what the kernel has no room for is lost, as on any link."""
        ground, onboard = self._ends[True], self._ends[False]
        for sysid, link, frame in self._simulator.transmissions():
            end, peer = (ground if link is Link.GROUND else onboard)[sysid]
            if peer is None:
                continue
            try:  # noqa: SIM105 - suppress() would double the cost of a datagram
                end.sendto(frame, peer)
            except OSError:
                pass
        if self._lidar is not None:
            self._send_lidar(self._lidar)
        if self._radio is not None:
            self._send_radio(self._radio)

    def _send_lidar(self, end: socket.socket) -> None:
        first = FIRST_PORT + self._settings.instance_base
        for sysid, datagram in self._simulator.lidar_datagrams():
            with contextlib.suppress(OSError):
                end.sendto(datagram, (self._settings.host, first + sysid - 1))

    def _send_radio(self, end: socket.socket) -> None:
        shift = self._settings.instance_base
        for sysid, datagram in self._simulator.radio_datagrams():
            with contextlib.suppress(OSError):
                end.sendto(datagram, (self._settings.host, fleet_port(sysid) + shift))

    def _receive_radio(self, end: socket.socket) -> None:
        """Companions are told apart by the ports from which they speak."""
        for _ in range(MOST_AT_ONCE):
            try:
                datagram, (_, port) = end.recvfrom(LARGEST_DATAGRAM_BYTES)
            except OSError:
                break
            sysid = port - FIRST_FLEET_PORT - self._settings.instance_base + 1
            self._simulator.receive_radio(sysid, datagram)
        self._send_radio(end)

    def close(self) -> None:
        if self._radio is not None:
            asyncio.get_running_loop().remove_reader(self._radio)
            self._radio.close()
            self._radio = None
        if self._lidar is not None:
            self._lidar.close()
            self._lidar = None
        for ends in self._ends.values():
            for end, _ in ends.values():
                asyncio.get_running_loop().remove_reader(end)
                end.close()
            ends.clear()

    def _ports(self) -> list[_Port]:
        """All ports to be opened.

        With `--onboard-ports` the peer of an onboard link may be a port that is ours already, or the ground station's:
        no companion can be there, and the link stays silent.
        """
        settings, shift = self._settings, self._settings.instance_base
        sysids = list(self._simulator.vehicles)
        ground = [_Port(i, Link.GROUND, GROUND_PORT + i - 1 + shift, GCS_PORT + shift) for i in sysids]
        onboard = [
            _Port(i, Link.ONBOARD, onboard_port(i, settings.onboard_port) + shift, settings.companion_port(i) + shift)
            for i in sysids
        ]
        taken = {port.own for port in ground + onboard} | {GCS_PORT + shift}
        return ground + [port._replace(peer=None) if port.peer in taken else port for port in onboard]

    def _open_one(self, port: _Port) -> None:
        host = self._settings.host
        end = bind(host, port.own, f"{port.link.value} link of vehicle {port.sysid}")
        peer = (host, port.peer) if port.peer is not None else None
        self._ends[port.link is Link.GROUND][port.sysid] = end, peer
        asyncio.get_running_loop().add_reader(end, self._receive, port.sysid, port.link, end)

    def _receive(self, sysid: int, link: Link, end: socket.socket) -> None:
        """Hand all waiting datagrams to the vehicle; an ICMP error of an absent peer is none of our business."""
        for _ in range(MOST_AT_ONCE):
            try:
                datagram = end.recv(LARGEST_DATAGRAM_BYTES)
            except OSError:
                break
            self._simulator.receive(sysid, link, datagram)
        self.send()


def bind(host: str, port: int, purpose: str) -> socket.socket:
    """A UDP socket that does not block.

    Raises:
        PortInUse: somebody else has it.
    """
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


async def run(
    simulator: Simulator, links: FleetLinks, settings: Settings, log: TruthLog | None, files: MemoryFiles | None
) -> None:
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
        if files is not None:
            files.save(simulator.memories)
        for collision in simulator.collisions[reported:]:
            print(f"sitl: {collision}", file=sys.stderr, flush=True)
        reported = len(simulator.collisions)
        due_s += interval_s
        late_s = loop.time() - due_s
        if late_s > SLIP_S:
            due_s += late_s
        await asyncio.sleep(max(-late_s, 0.0))
