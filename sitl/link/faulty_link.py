"""The faults of a link, both ways: loss, delay, jitter, copies, order, wrong bytes, bandwidth, blackouts; sans-IO."""

import heapq
import itertools
import math
from collections.abc import Sequence
from enum import Enum

import numpy as np

from missions.faults import LinkConditions
from missions.mission import Blackout, LinkSettings

LONGEST_QUEUE_S = 1.0
"""What would have to wait longer for its turn on a narrow link is lost."""
HELD_BACK_S = 0.05
"""A datagram that others overtake, or the second copy of one, is this much later."""
PERFECT = LinkConditions()


class Direction(Enum):
    """Which way a datagram goes."""

    UP = "to the vehicle"
    DOWN = "from the vehicle"


class FaultyLink:
    """Datagrams of one vehicle's link on their way.

    Args:
        settings: what the mission makes of the link.
        rng: decides what is lost and how long the rest takes.
    """

    def __init__(self, settings: LinkSettings, rng: np.random.Generator) -> None:
        self._blackouts: Sequence[Blackout] = settings.blackouts
        self._conditions: LinkConditions = PERFECT
        self._rng = rng
        self._flying: dict[Direction, list[tuple[float, int, bytes]]] = {way: [] for way in Direction}
        self._free_s: dict[Direction, float] = {}
        """When a narrow link has sent what waits for it."""
        self._n_flying = 0
        self._latest_s = dict.fromkeys(Direction, -math.inf)
        """When the last datagram arrives that others do not overtake."""
        self._order = itertools.count()
        self._black_until_s = -math.inf
        self.sent = self.lost = 0
        self.change(settings)

    def change(self, conditions: LinkConditions) -> None:
        """The link becomes like this; datagrams that are on their way stay as they are."""
        names = LinkConditions.__struct_fields__
        self._conditions = LinkConditions(**{name: getattr(conditions, name) for name in names})
        self._free_s = dict.fromkeys(Direction, -math.inf)
        self._is_plain = self._conditions == PERFECT and not self._blackouts

    def black_out(self, until_s: float) -> None:
        """Let nothing pass until then."""
        self._black_until_s = until_s

    def is_perfect(self, now_s: float) -> bool:
        """Whether datagrams may pass by this object: no faults, and nothing is on its way that they would overtake."""
        return self._n_flying == 0 and self._is_plain and now_s >= self._black_until_s

    def send(self, way: Direction, datagram: bytes, now_s: float, since_takeoff_s: float | None) -> None:
        """Put a datagram on its way.

        Args:
            way: up or down.
            datagram: the bytes.
            now_s: simulated time.
            since_takeoff_s: simulated time since the fleet's first take-off, from which blackouts count.
        """
        self.sent += 1
        c = self._conditions
        departure_s = self._departure_s(way, len(datagram), now_s)
        if departure_s is None or self._is_black(now_s, since_takeoff_s) or self._happens(c.loss):
            self.lost += 1
            return
        if self._happens(c.corruption):
            datagram = self._corrupted(datagram)
        arrival_s = departure_s + c.delay_s
        if c.jitter_s > 0.0:
            arrival_s += c.jitter_s * self._rng.random()
        else:
            arrival_s = self._latest_s[way] = max(arrival_s, self._latest_s[way])
        if self._happens(c.reorder):
            arrival_s += HELD_BACK_S
        self._push(way, arrival_s, datagram)
        if self._happens(c.duplicates):
            self._push(way, arrival_s + HELD_BACK_S, datagram)

    def arrived(self, way: Direction, now_s: float) -> list[bytes]:
        """The datagrams that have arrived by now, in the order of their arrival."""
        queue = self._flying[way]
        out: list[bytes] = []
        while queue and queue[0][0] <= now_s:
            out.append(heapq.heappop(queue)[2])
        self._n_flying -= len(out)
        return out

    def _push(self, way: Direction, arrival_s: float, datagram: bytes) -> None:
        heapq.heappush(self._flying[way], (arrival_s, next(self._order), datagram))
        self._n_flying += 1

    def _departure_s(self, way: Direction, n_bytes: int, now_s: float) -> float | None:
        """When a datagram has got through the bottleneck; None if it found no room to wait."""
        if self._conditions.bandwidth_bytes_s == 0.0:
            return now_s
        begin_s = max(now_s, self._free_s[way])
        if begin_s - now_s > LONGEST_QUEUE_S:
            return None
        self._free_s[way] = begin_s + n_bytes / self._conditions.bandwidth_bytes_s
        return self._free_s[way]

    def _corrupted(self, datagram: bytes) -> bytes:
        """The datagram with one byte changed; an empty one stays what it is."""
        if not datagram:
            return datagram
        changed = bytearray(datagram)
        changed[int(self._rng.integers(len(changed)))] ^= int(self._rng.integers(1, 256))
        return bytes(changed)

    def _happens(self, share: float) -> bool:
        return share > 0.0 and bool(self._rng.random() < share)

    def _is_black(self, now_s: float, since_takeoff_s: float | None) -> bool:
        if now_s < self._black_until_s:
            return True
        if since_takeoff_s is None:
            return False
        return any(0.0 <= since_takeoff_s - b.from_s < b.duration_s for b in self._blackouts)
