"""A ground station's microservice against the simulator's mission server over a simulated link, in virtual time.

Client and server were written apart; between them go packed frames, each way late by the link's delay, and some lost.
"""

import heapq
import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from gcs.link.codec import Codec
from gcs.microservices import Microservice
from missions.mission_items import MissionItem
from sitl.autopilot.plan import Plan
from sitl.autopilot.reports import Severity
from sitl.microservices.mission_transfer_server import MissionTransferServer, MissionType
from sitl.microservices.outbox import Link, Outbox, Sender
from sitl.wire import FrameReader
from tests.benchmarks.link.conditions import ONE_WAY_DELAY_S

SERVER_TICK_S = 0.02
UP, DOWN, TICK = range(3)
SENDER = Sender(Link.GROUND, 255, 190)
LONGEST_S = 3600.0


class Shelf:
    """A vehicle's plans, and all that were ever stored in it."""

    def __init__(self) -> None:
        self.plans: dict[MissionType, Plan] = {kind: Plan() for kind in MissionType}
        self.history: list[tuple[MissionItem, ...]] = []
        self.uploading: Link | None = None

    def plan(self, kind: MissionType) -> Plan:
        return self.plans[kind]

    def store(self, kind: MissionType, items: tuple[MissionItem, ...]) -> None:
        self.plans[kind] = Plan(items)
        self.history.append(items)


@dataclass(frozen=True)
class LinkModel:
    """The same both ways: share lost, one-way delay [s] and its variation [s], and outages (from, until) [s]."""

    loss: float = 0.0
    delay_s: float = ONE_WAY_DELAY_S
    jitter_s: float = 0.0
    outages_s: tuple[tuple[float, float], ...] = ()


class Conversation:
    """One vehicle's server and whatever talks to it."""

    def __init__(self, link: LinkModel, rng: np.random.Generator) -> None:
        self.link, self._rng = link, rng
        self.now_s = 0.0
        self.shelf = Shelf()
        self.frames = {UP: 0, DOWN: 0}
        self._outbox = Outbox(1)
        store: Any = self.shelf
        autopilot: Any = None
        self._server = MissionTransferServer(Link.GROUND, store, autopilot, self._outbox, _silent, 1.0)
        self._reader, self._codec = FrameReader(), Codec()
        self._events: list[tuple[float, int, int, bytes]] = []
        self._order = itertools.count()
        self._push(SERVER_TICK_S, TICK, b"")

    def run(self, service: Microservice) -> None:
        """Drive a microservice to its end; its own errors pass through."""
        self._send(service.start(self.now_s))
        while not service.done and self.now_s < LONGEST_S:
            if service.deadline_s <= self._events[0][0]:
                self.now_s = max(self.now_s, service.deadline_s)
                self._send(service.handle_timeout(self.now_s))
                continue
            self.now_s, _, what, frame = heapq.heappop(self._events)
            self._happen(what, frame, service)

    def _happen(self, what: int, frame: bytes, service: Microservice) -> None:
        if what == UP:
            self._serve(frame)
        elif what == DOWN:
            for message in self._codec.parse(frame):
                if message.get_type() in service.wants and not service.done:
                    self._send(service.receive(message, self.now_s))
        else:
            self._server.tick(self.now_s)
            self._push(self.now_s + SERVER_TICK_S, TICK, b"")
        for _, answer in self._outbox.take():
            self._transmit(DOWN, answer)

    def _serve(self, frame: bytes) -> None:
        for message in self._reader.read(frame):
            serve(self._server, message, self.now_s)

    def _send(self, messages: list[Any]) -> None:
        for message in messages:
            self._transmit(UP, self._codec.pack(message))

    def _transmit(self, way: int, frame: bytes) -> None:
        self.frames[way] += 1
        down = any(begin <= self.now_s < end for begin, end in self.link.outages_s)
        if down or self._rng.random() < self.link.loss:
            return
        late_s = self.link.jitter_s * self._rng.random() if self.link.jitter_s else 0.0
        self._push(self.now_s + self.link.delay_s + late_s, way, frame)

    def _push(self, at_s: float, what: int, frame: bytes) -> None:
        heapq.heappush(self._events, (at_s, next(self._order), what, frame))


def serve(server: MissionTransferServer, message: Any, now_s: float) -> None:
    """Hand a ground station's message to a vehicle's mission server, if it is for that."""
    match message.get_type():
        case "MISSION_COUNT":
            server.receive_count(message, SENDER, now_s)
        case "MISSION_ITEM_INT":
            server.receive_item_int(message, SENDER, now_s)
        case "MISSION_REQUEST_LIST":
            server.receive_request_list(message, SENDER, now_s)
        case "MISSION_REQUEST_INT":
            server.receive_request_int(message, SENDER, now_s)
        case "MISSION_ACK":
            server.receive_ack(message, SENDER, now_s)


def _silent(severity: Severity, text: str) -> None:
    """Texts are not what is measured."""
