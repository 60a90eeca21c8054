"""The fleet link's socket: a relay such as the simulator's radio, a multicast group, or a broadcast address."""

import socket
import struct
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from urllib.parse import urlsplit

from companion.errors import UsageError

RECEIVE_BUFFER_BYTES = 1 << 20
LARGEST_DATAGRAM_BYTES = 4096
HOPS = 1
"""Multicast stays in the fleet's own network."""


class Way(Enum):
    """How one companion reaches all others."""

    RELAY = "udpout"
    """Everything goes to one address, which passes it on to the others."""
    MULTICAST = "mcast"
    BROADCAST = "udpbcast"


@dataclass(frozen=True)
class FleetAddress:
    """Where a fleet link leads.

    Args:
        way: how.
        host: address, group or broadcast address.
        port: of that; with MULTICAST and BROADCAST everybody's.
        interface: of the multicast group; any for none.
    """

    way: Way
    host: str
    port: int
    interface: str = "0.0.0.0"


def parse_fleet_link(url: str) -> FleetAddress:
    """Read a `--fleet-link`.

    Raises:
        UsageError: it is none.

    Example:
        >>> parse_fleet_link("mcast://239.255.145.50:14700").way
        <Way.MULTICAST: 'mcast'>
        >>> parse_fleet_link("mcast://239.255.145.50:14700/192.168.1.7").interface
        '192.168.1.7'
    """
    examples = "udpout://127.0.0.1:14980, mcast://239.255.145.50:14700 or udpbcast://192.168.1.255:14700"
    try:
        parts = urlsplit(url)
        way, port, interface = Way(parts.scheme), parts.port, parts.path.strip("/") or "0.0.0.0"
        socket.inet_aton(parts.hostname or "")
        socket.inet_aton(interface)
    except (ValueError, OSError):
        raise UsageError(f"--fleet-link {url}: expected something like {examples}") from None
    if not port:
        raise UsageError(f"--fleet-link {url}: expected a port, as in {examples}")
    return FleetAddress(way, parts.hostname or "", port, interface)


class FleetPort:
    """A bound socket of the fleet link.

    Args:
        address: where it leads.
        own_port: to be bound for a relay; groups and broadcasts are heard at their own port.

    Raises:
        UsageError: it cannot be bound, or the group cannot be joined.
    """

    def __init__(self, address: FleetAddress, own_port: int) -> None:
        self._to = address.host, address.port
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        bound = (address.host, own_port)
        try:
            if address.way is Way.RELAY:
                bound = _own_address(address.host), own_port
            else:
                bound = address.host if address.way is Way.MULTICAST else "0.0.0.0", address.port
                self._share(address)
            self._socket.bind(bound)
        except OSError as problem:
            self._socket.close()
            raise UsageError(f"fleet link {bound[0]}:{bound[1]}: {str(problem.strerror).lower()}") from None

    def poll(self) -> Iterator[bytes]:
        """The datagrams that have come in since the last call, the oldest first."""
        with suppress(OSError):
            while True:
                yield self._socket.recv(LARGEST_DATAGRAM_BYTES)

    def send(self, datagram: bytes) -> None:
        """To all others; what the network has no room for is lost, as on any radio."""
        with suppress(OSError):
            self._socket.sendto(datagram, self._to)

    def close(self) -> None:
        self._socket.close()

    def __enter__(self) -> "FleetPort":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _share(self, address: FleetAddress) -> None:
        """Several companions of one machine hear the same group, or the same broadcasts."""
        end = self._socket
        end.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if address.way is Way.BROADCAST:
            end.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
            return
        interface = socket.inet_aton(address.interface)
        end.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, HOPS)
        end.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
        end.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, interface)
        joined = struct.pack("4s4s", socket.inet_aton(address.host), interface)
        end.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, joined)


def _own_address(relay: str) -> str:
    """Of this machine, as the relay sees it: loopback stays on loopback."""
    return "127.0.0.1" if relay.startswith("127.") else "0.0.0.0"
