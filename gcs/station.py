"""The station: every vehicle on every link. It folds what arrives into the fleet's state, hands it to the
microservices that run, and sends for them.
"""

import asyncio
import math
import time
from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

from gcs.dialect import Message, mavlink
from gcs.errors import LinkLost
from gcs.fleet.fleet import Fleet
from gcs.fleet.vehicle_state import VehicleState
from gcs.link.codec import Codec
from gcs.link.tlog import TlogWriter
from gcs.microservices import Microservice
from gcs.security.audit import Audit

HEARTBEAT_INTERVAL_S = 1.0

Address = tuple[str, int]
S = TypeVar("S", bound=Microservice)


class Connection(Protocol):
    """What a datagram socket, or its stand-in in memory, does for the station."""

    peer: Address | None

    def send(self, datagram: bytes, address: Address) -> None: ...


@dataclass
class _Inbox:
    wants: frozenset[str]
    queue: asyncio.Queue[Message]


@dataclass
class Station:
    """One ground station on any number of connections.

    Args:
        recording: where all frames, received and sent, are written.
        audit: where all orders and their results are written.
        unix_us: the wall clock for the recording's stamps.
    """

    recording: TlogWriter | None = None
    audit: Audit | None = None
    unix_us: Callable[[], int] = lambda: time.time_ns() // 1000
    fleet: Fleet = field(default_factory=Fleet)
    codec: Codec = field(default_factory=Codec)
    connections: list[Connection] = field(default_factory=list)
    sent: dict[int, int] = field(default_factory=lambda: defaultdict(int))
    """Messages sent to each system."""

    def __post_init__(self) -> None:
        self._routes: dict[int, tuple[Connection, Address]] = {}
        self._inboxes: dict[tuple[int, int], list[_Inbox]] = defaultdict(list)

    def receive(self, connection: Connection, datagram: bytes, address: Address) -> None:
        """Take in one datagram."""
        now_s = self.now_s
        for message in self.codec.parse(datagram):
            source = (message.get_srcSystem(), message.get_srcComponent())
            if source == (self.codec.system, self.codec.component) or source[0] == 0:
                continue  # our own frame, forwarded back to us, or nobody's
            if self.recording is not None:
                self.recording.write(message.get_msgbuf(), self.unix_us())
            self._routes[source[0]] = (connection, address)
            self.fleet.fold(message, now_s)
            if not self._is_for_us(message):
                continue
            if self.audit is not None:
                self.audit.received(message)
            for inbox in self._inboxes.get(source, ()):
                if message.get_type() in inbox.wants:
                    inbox.queue.put_nowait(message)

    def send(self, message: Message, sysid: int) -> None:
        """Send to where `sysid` was last heard; a system that was never heard gets nothing."""
        route = self._routes.get(sysid)
        if route is not None:
            connection, address = route
            self._transmit(message, connection, address, sysid)
            self.sent[sysid] += 1

    async def run(self, service: S) -> S:
        """Drive one microservice to its end; its own errors pass through."""
        inbox = _Inbox(service.wants, asyncio.Queue())
        self._inboxes[service.peer].append(inbox)
        try:
            self._send_all(service.start(self.now_s), service.peer[0])
            while not service.done:
                try:
                    async with asyncio.timeout_at(service.deadline_s if math.isfinite(service.deadline_s) else None):
                        message = await inbox.queue.get()
                except TimeoutError:
                    self._send_all(service.handle_timeout(self.now_s), service.peer[0])
                else:
                    self._send_all(service.receive(message, self.now_s), service.peer[0])
            return service
        finally:
            self._inboxes[service.peer].remove(inbox)

    async def send_heartbeats(self) -> None:
        """Say every second that this ground station is here; runs until it is cancelled."""
        heartbeat = mavlink.MAVLink_heartbeat_message(
            mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, 3
        )
        while True:
            for (connection, address, _), sysid in self._destinations().items():
                self._transmit(heartbeat, connection, address, sysid)
            await asyncio.sleep(HEARTBEAT_INTERVAL_S)

    async def holds_within(self, condition: Callable[[], bool], timeout_s: float, poll_s: float = 0.02) -> bool:
        """Wait until something holds in the fleet's state; False if it did not within `timeout_s`."""
        deadline_s = self.now_s + timeout_s
        while not condition():
            if self.now_s >= deadline_s:
                return False
            await asyncio.sleep(poll_s)
        return True

    async def wait_until(self, condition: Callable[[], bool], timeout_s: float, otherwise: str) -> None:
        """Wait until something holds in the fleet's state.

        Raises:
            LinkLost: it did not come to hold within `timeout_s`; says `otherwise`.
        """
        if not await self.holds_within(condition, timeout_s):
            raise LinkLost(f"{otherwise} (waited {timeout_s:g} s)")

    def vehicle(self, sysid: int) -> VehicleState:
        """The state of a vehicle that has been heard.

        Raises:
            LinkLost: it has not.
        """
        try:
            return self.fleet.vehicles[sysid]
        except KeyError:
            raise LinkLost(f"vehicle {sysid} has not been heard") from None

    @property
    def now_s(self) -> float:
        """The running event loop's monotonic clock [s]."""
        return asyncio.get_running_loop().time()

    def _is_for_us(self, message: Message) -> bool:
        """Routers carry also what is meant for companions and other ground stations: it answers nothing of ours."""
        ours = (self.codec.system, self.codec.component)
        targets = getattr(message, "target_system", 0), getattr(message, "target_component", 0)
        return all(target in {0, our} for target, our in zip(targets, ours, strict=True))

    def _send_all(self, messages: Iterable[Message], sysid: int) -> None:
        for message in messages:
            self.send(message, sysid)

    def _transmit(self, message: Message, connection: Connection, address: Address, sysid: int) -> None:
        if self.audit is not None:
            self.audit.sent(message, sysid)
        frame = self.codec.pack(message, sysid)
        if self.recording is not None:
            self.recording.write(frame, self.unix_us())
        connection.send(frame, address)

    def _destinations(self) -> dict[tuple[Connection, Address, bytes | None], int]:
        """Everybody who was heard, and the peers of connections on which nobody was heard yet.

        Where several vehicles are behind one address, one of them stands for all that have its key.
        """
        routes = set(self._routes.values())
        silent = {(c, c.peer, None): 0 for c in self.connections if c.peer is not None and (c, c.peer) not in routes}
        heard = {(*route, self.codec.signing.key(sysid)): sysid for sysid, route in self._routes.items()}
        return silent | heard
