"""The station: every vehicle on every link. It folds what arrives into the fleet's state, hands it to the
microservices that run, and sends for them.
"""

import asyncio
import time
from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TypeVar

from gcs.dialect import AUTOPILOT, COMPANION, Message, mavlink
from gcs.errors import AmbiguousVehicle, LinkLost
from gcs.exchange import Exchange
from gcs.fleet.fleet import Fleet
from gcs.fleet.flood_gate import FloodGate
from gcs.fleet.vehicle_state import VehicleState
from gcs.link.codec import Codec
from gcs.link.connection import Address, Connection
from gcs.link.paths import LinkQuality
from gcs.link.routes import Routes
from gcs.link.shaper import Shaper, Urgency
from gcs.link.tlog import TlogWriter
from gcs.microservices import Microservice
from gcs.microservices.mission_messages import LinkEstimate
from gcs.security.audit import Audit
from missions.tunnel import MAX_PAYLOAD_BYTES, PayloadType, Receipt, encode_receipt

HEARTBEAT_INTERVAL_S = 1.0
STOOD_STILL_S = 0.5
"""A look at the fleet that comes later than this is one after a standstill, not one on a busy machine."""
MOST_NOTICES, NOTICES_WINDOW_S = 20, 10.0
"""Sentences about the links; of more at once the rest is counted."""
BULK = frozenset({"MISSION_ITEM_INT", "MISSION_REQUEST_INT", "PARAM_SET", "PARAM_REQUEST_READ", "PARAM_REQUEST_LIST"})
"""What gives way to everything else where a link's budget is short."""

S = TypeVar("S", bound=Microservice)


def _who_are_you(sysid: int) -> Message:
    """A request for AUTOPILOT_VERSION, which has the hardware's id."""
    params = (float(mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION), *(0.0,) * 6)
    request = mavlink.MAV_CMD_REQUEST_MESSAGE
    return mavlink.MAVLink_command_long_message(sysid, AUTOPILOT, request, 0, *params)


@dataclass
class Station:
    """One ground station on any number of connections.

    Args:
        recording: where all frames, received and sent, are written.
        audit: where all orders and their results are written.
        unix_us: the wall clock for the recording's stamps.
        say: takes a sentence for the operator about links and who is on them.
    """

    recording: TlogWriter | None = None
    audit: Audit | None = None
    unix_us: Callable[[], int] = lambda: time.time_ns() // 1000
    fleet: Fleet = field(default_factory=Fleet)
    codec: Codec = field(default_factory=Codec)
    connections: list[Connection] = field(default_factory=list[Connection])
    sent: dict[int, int] = field(default_factory=lambda: defaultdict(int))
    """Messages sent to each system."""
    say: Callable[[str], None] = lambda text: None

    def __post_init__(self) -> None:
        self.routes = Routes((self.codec.system, self.codec.component), self.tell)
        self._gate, self._untold = FloodGate(MOST_NOTICES, NOTICES_WINDOW_S), 0
        self._exchanges: dict[tuple[int, int], list[Exchange]] = defaultdict(list)
        self._turns: dict[tuple[tuple[int, int], str], asyncio.Lock] = {}
        self._shapers: dict[Connection, Shaper] = {}
        self._pumping: set[Connection] = set()
        self._numbers: dict[Connection, int] = {}

    def receive(self, connection: Connection, datagram: bytes, address: Address) -> None:
        """Take in one datagram."""
        now_s = self.now_s
        way = (connection, address)
        for message in self.codec.parse(datagram):
            if not self.routes.heard(message, way, now_s):
                continue  # our own frame, nobody's, or a second vehicle with the same system id
            if self.recording is not None:
                self.recording.write(message.get_msgbuf(), self.unix_us())
            self.fleet.fold(message, now_s)
            if not self._is_for_us(message):
                continue
            if self.audit is not None:
                self.audit.received(message)
            for exchange in tuple(self._exchanges.get((message.get_srcSystem(), message.get_srcComponent()), ())):
                exchange.deliver(message)

    def send(self, message: Message, sysid: int) -> None:
        """Send to where `sysid` is heard best; a system that was never heard gets nothing."""
        way = self.routes.best(sysid, self.now_s)
        if way is not None:
            self._transmit(message, way, sysid)
            self.sent[sysid] += 1

    async def run(self, service: S) -> S:
        """Drive one microservice to its end; its own errors pass through.

        Exchanges of one kind with one component wait for each other's end. One that is cancelled says so to its peer.

        Raises:
            AmbiguousVehicle: two vehicles use this system id, and what is asked would not make the flight safer.
        """
        sysid = service.peer[0]
        rivals = self.routes.rivals(sysid, self.now_s)
        if rivals and not service.makes_safe:
            raise AmbiguousVehicle(f"vehicle {sysid}: more than one vehicle uses this system id; nothing was sent")
        turn = service.turn
        if turn is None:
            return await self._run(service)
        async with self._turns.setdefault((service.peer, turn), asyncio.Lock()):
            return await self._run(service)

    async def _run(self, service: S) -> S:
        sysid = service.peer[0]
        exchange = Exchange(service, lambda messages: self._send_all(messages, sysid))
        exchanges = self._exchanges[service.peer]
        for other in tuple(exchanges):
            other.give_way_to(service)
        exchanges.append(exchange)
        try:
            await exchange.run()
        finally:
            exchanges.remove(exchange)
        return service

    async def send_heartbeats(self) -> None:
        """Say every second that this ground station is here, and measure round trips; runs until it is cancelled."""
        heartbeat = mavlink.MAVLink_heartbeat_message(
            mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, 3
        )
        while True:
            for (connection, address, _), sysid in self._destinations().items():
                self._transmit(heartbeat, (connection, address), sysid)
            for sysid in self.fleet.vehicles:
                self._measure_round_trips(sysid)
                self._acknowledge_observations(sysid)
            await asyncio.sleep(HEARTBEAT_INTERVAL_S)

    async def holds_within(self, condition: Callable[[], bool], timeout_s: float, poll_s: float = 0.02) -> bool:
        """Wait until something holds in the fleet's state; False if it did not within `timeout_s`.

        Time in which this program stood still does not count: what came meanwhile has not been read yet.
        """
        deadline_s = self.now_s + timeout_s
        while not condition():
            looked_s = self.now_s
            if looked_s >= deadline_s:
                return False
            await asyncio.sleep(poll_s)
            late_s = self.now_s - looked_s - poll_s
            deadline_s += late_s if late_s > STOOD_STILL_S else 0.0
        return True

    async def wait_until(self, condition: Callable[[], bool], timeout_s: float, otherwise: str) -> None:
        """Wait until something holds in the fleet's state.

        Raises:
            LinkLost: it did not come to hold within `timeout_s`; says `otherwise`.
        """
        if not await self.holds_within(condition, timeout_s):
            raise LinkLost(f"{otherwise} (waited {timeout_s:g} s)")

    def forget(self) -> None:
        """Know no vehicle any more: others will come in their place."""
        self.fleet.vehicles.clear()
        self.codec.sources.clear()
        self.routes = Routes((self.codec.system, self.codec.component), self.tell)

    def tell(self, text: str) -> None:
        """Say a sentence about links to the operator, unless there are too many at once."""
        if not self._gate.admits(self.now_s):
            self._untold += 1
            return
        if self._untold:
            self.say(f"{self._untold} more sentences about the links were left out")
            self._untold = 0
        self.say(text)

    def vehicle(self, sysid: int) -> VehicleState:
        """The state of a vehicle that has been heard.

        Raises:
            LinkLost: it has not.
        """
        try:
            return self.fleet.vehicles[sysid]
        except KeyError:
            raise LinkLost(f"vehicle {sysid} has not been heard") from None

    def quality(self, sysid: int) -> LinkQuality | None:
        """How well a system is heard over its best path; None if it never was."""
        return self.routes.quality(sysid, self.now_s)

    def link_estimate(self, sysid: int) -> LinkEstimate:
        """What is known of the way to a vehicle, for a transfer that begins."""
        quality = self.quality(sysid)
        if quality is None:
            return LinkEstimate()
        return LinkEstimate(quality.round_trip_s, quality.loss, quality.variation_s)

    def vehicles_on_link_of(self, sysid: int) -> tuple[int, float | None]:
        """How many systems share the connection over which `sysid` is reached, and its budget [bytes/s]."""
        way = self.routes.best(sysid, self.now_s)
        if way is None:
            return 1, None
        sharing = sum(1 for other in self.fleet.vehicles if self._connection(other) is way[0])
        return max(sharing, 1), way[0].budget_bytes_s

    @property
    def now_s(self) -> float:
        """The running event loop's monotonic clock [s]."""
        return asyncio.get_running_loop().time()

    def _connection(self, sysid: int) -> Connection | None:
        way = self.routes.best(sysid, self.now_s)
        return way[0] if way is not None else None

    def _is_for_us(self, message: Message) -> bool:
        """Routers carry also what is meant for companions and other ground stations: it answers nothing of ours."""
        ours = (self.codec.system, self.codec.component)
        targets = getattr(message, "target_system", 0), getattr(message, "target_component", 0)
        return all(target in {0, our} for target, our in zip(targets, ours, strict=True))

    def _measure_round_trips(self, sysid: int) -> None:
        """On every path; where there are several, it is also asked whose they are."""
        live = self.routes.live_paths(sysid, self.now_s)
        for way, path in live:
            self._transmit(mavlink.MAVLink_timesync_message(0, path.ping(self.now_s)), way, sysid)
            if len(live) > 1 and path.hardware_id is None:
                self._transmit(_who_are_you(sysid), way, sysid)

    def _acknowledge_observations(self, sysid: int) -> None:
        """Tell a companion how much of it is heard: its reports take as much of the link as there is."""
        companion = self.fleet.vehicles[sysid].companion
        if companion.status is None or not self.fleet.vehicles[sysid].companion_online(self.now_s):
            return
        age_s, boot_ms = self.now_s - companion.status_s, companion.status.time_boot_ms
        payload = encode_receipt(Receipt(heard=companion.observations_heard, time_boot_ms=boot_ms, age_s=age_s))
        padded = list(payload.ljust(MAX_PAYLOAD_BYTES, b"\0"))
        self.send(mavlink.MAVLink_tunnel_message(sysid, COMPANION, PayloadType.RECEIPT, len(payload), padded), sysid)

    def _send_all(self, messages: Iterable[Message], sysid: int) -> None:
        for message in messages:
            self.send(message, sysid)

    def _transmit(self, message: Message, way: tuple[Connection, Address], sysid: int) -> None:
        connection, address = way
        if self.audit is not None:
            self.audit.sent(message, sysid)
        bulk = message.get_type() in BULK
        frame = self.codec.pack(message, sysid, lane=way, link_id=self._link_id(connection, bulk))
        if self.recording is not None:
            self.recording.write(frame, self.unix_us())
        if connection.budget_bytes_s is None:
            connection.send(frame, address)
            return
        shaper = self._shapers.setdefault(connection, Shaper(connection.budget_bytes_s))
        urgency = Urgency.BULK if bulk else Urgency.CONTROL
        for due, where in shaper.offer(frame, address, urgency, self.now_s):
            connection.send(due, where)
        self._pump_later(connection, shaper)

    def _link_id(self, connection: Connection, bulk: bool) -> int:
        """The signing stream of a frame: what may overtake, or comes over another link, has timestamps of its own."""
        number = self._numbers.setdefault(connection, len(self._numbers))
        return (2 * number + bulk) % 256

    def _pump_later(self, connection: Connection, shaper: Shaper) -> None:
        wait_s = shaper.wait_s
        if wait_s is not None and connection not in self._pumping:
            self._pumping.add(connection)
            asyncio.get_running_loop().call_later(wait_s, self._pump, connection, shaper)

    def _pump(self, connection: Connection, shaper: Shaper) -> None:
        self._pumping.discard(connection)
        for due, where in shaper.due(self.now_s):
            connection.send(due, where)
        self._pump_later(connection, shaper)

    def _destinations(self) -> dict[tuple[Connection, Address, bytes | None], int]:
        """Everybody who was heard, and the peers of connections on which nobody was heard yet.

        Where several vehicles are behind one address, one of them stands for all that have its key.
        """
        ways = self.routes.live_ways(self.now_s)
        routes = {way for _, way in ways}
        silent = {(c, c.peer, None): 0 for c in self.connections if c.peer is not None and (c, c.peer) not in routes}
        heard = {(*way, self.codec.signing.key(sysid)): sysid for sysid, way in ways}
        return silent | heard
