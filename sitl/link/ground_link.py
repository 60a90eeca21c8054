"""The faults of the ground link, both ways: loss, delay, jitter, blackouts; sans-IO, on simulated time, seeded."""

import heapq
import itertools
from enum import Enum

import numpy as np

from missions.mission import LinkSettings


class Direction(Enum):
    """Which way a datagram goes."""

    UP = "to the vehicle"
    DOWN = "to the ground"


class GroundLink:
    """Datagrams of one vehicle's ground link on their way.

    Args:
        settings: what the mission makes of the link.
        rng: decides what is lost and how long the rest takes.
    """

    def __init__(self, settings: LinkSettings, rng: np.random.Generator) -> None:
        self._settings = settings
        self._rng = rng
        self._flying: dict[Direction, list[tuple[float, int, bytes]]] = {way: [] for way in Direction}
        self._order = itertools.count()
        self.is_perfect = settings == LinkSettings()
        self.sent = self.lost = 0

    def send(self, way: Direction, datagram: bytes, now_s: float, since_takeoff_s: float | None) -> None:
        """Put a datagram on its way.

        Args:
            way: up or down.
            datagram: the bytes.
            now_s: simulated time.
            since_takeoff_s: simulated time since the fleet's first take-off, from which blackouts count.
        """
        self.sent += 1
        if self._is_black(since_takeoff_s) or (self._settings.loss > 0.0 and self._rng.random() < self._settings.loss):
            self.lost += 1
            return
        delay_s = self._settings.delay_s
        if self._settings.jitter_s > 0.0:
            delay_s += self._settings.jitter_s * self._rng.random()
        heapq.heappush(self._flying[way], (now_s + delay_s, next(self._order), datagram))

    def arrived(self, way: Direction, now_s: float) -> list[bytes]:
        """The datagrams that have arrived by now, in the order of their arrival."""
        queue, out = self._flying[way], []
        while queue and queue[0][0] <= now_s:
            out.append(heapq.heappop(queue)[2])
        return out

    def _is_black(self, since_takeoff_s: float | None) -> bool:
        if since_takeoff_s is None:
            return False
        return any(0.0 <= since_takeoff_s - b.from_s < b.duration_s for b in self._settings.blackouts)
