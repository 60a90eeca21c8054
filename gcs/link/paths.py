"""Over which address of which connection each system is heard, how well, and over which one it is best reached.

A vehicle may be heard over several links at once; each path counts its own sequence numbers, round trips and age.
Two autopilots with one system id are told apart by their boot clocks and hardware ids. Sans-IO.
"""

import math
from collections import deque
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from gcs.link.codec import SourceCount

PathKey = TypeVar("PathKey")

STALE_S = 1.5
"""A path unheard for so long gives way to one that is heard."""
LIVE_S = 2.5
"""Two paths heard within so long are both there."""
BETTER_LOSS = 0.15
"""A fresh path that loses so much less takes over from a fresh one."""
CLOCK_TOLERANCE_S = 3.0
"""Two boot clocks that differ by more are two vehicles, or one before and after a reboot."""
MOST_PATHS = 8
"""Of one system; the one that was silent longest gives way."""
MOST_PINGS = 8
WINDOW_S = 5.0
NANO = 1e-9


@dataclass(frozen=True)
class LinkQuality:
    """How well one vehicle is heard over one path, or over its best one."""

    loss: float
    """Share lost of what it sent in the last seconds, 0 to 1."""
    round_trip_s: float | None
    """None before the first answer."""
    variation_s: float | None
    """Mean variation of round trips; None before the second answer."""
    age_s: float
    """Since the last message of any kind."""
    received: int
    lost: int


@dataclass
class Path:
    """One way to one system."""

    heard_s: float = -math.inf
    count: SourceCount = field(default_factory=SourceCount)
    round_trip_s: float | None = None
    variation_s: float | None = None
    boot_clock_s: float | None = None
    """The system's clock when this one's was 0, from its newest telemetry."""
    hardware_id: int | None = None
    _marks: deque[tuple[float, int, int]] = field(default_factory=lambda: deque(maxlen=16))
    _pings: dict[int, float] = field(default_factory=dict[int, float])

    def hear(self, seq: int, now_s: float) -> None:
        self.heard_s = now_s
        self.count.count(seq)
        if not self._marks or now_s - self._marks[-1][0] >= WINDOW_S / 8:
            self._marks.append((now_s, self.count.received, self.count.lost))

    def ping(self, now_s: float) -> int:
        """Begin a round trip; the number [ns] that its answer will carry."""
        stamp = round(now_s / NANO)
        self._pings[stamp] = now_s
        while len(self._pings) > MOST_PINGS:
            del self._pings[next(iter(self._pings))]
        return stamp

    def pong(self, stamp: int, now_s: float) -> None:
        """An answer; one to a question that was not asked counts for nothing."""
        sent_s = self._pings.pop(stamp, None)
        if sent_s is not None:
            self._learn(now_s - sent_s)

    def _learn(self, took_s: float) -> None:
        if self.round_trip_s is None:
            self.round_trip_s = took_s
            return
        off_s = abs(took_s - self.round_trip_s)
        self.variation_s = off_s if self.variation_s is None else 0.75 * self.variation_s + 0.25 * off_s
        self.round_trip_s += 0.25 * (took_s - self.round_trip_s)

    def quality(self, now_s: float) -> LinkQuality:
        """Loss over the last `WINDOW_S`, and the rest as of now."""
        begin = next((mark for mark in self._marks if now_s - mark[0] <= WINDOW_S), (0.0, 0, 0))
        received, lost = self.count.received - begin[1], self.count.lost - begin[2]
        loss = min(max(lost / max(received + lost, 1), 0.0), 1.0)
        trip = self.round_trip_s, self.variation_s
        return LinkQuality(loss, *trip, now_s - self.heard_s, self.count.received, self.count.lost)


@dataclass
class SystemPaths(Generic[PathKey]):
    """All ways to one system."""

    paths: dict[PathKey, Path] = field(default_factory=dict[PathKey, Path])
    chosen: PathKey | None = None
    changes: int = 0
    """How often another path was chosen."""

    def path(self, key: PathKey) -> Path:
        known = self.paths.get(key)
        if known is None:
            if len(self.paths) >= MOST_PATHS:
                others = [other for other in self.paths if other != self.chosen]
                del self.paths[min(others, key=lambda other: self.paths[other].heard_s)]
            known = self.paths[key] = Path()
        return known

    def choose(self, now_s: float) -> PathKey | None:
        """The path to send over: the present one as long as it is fresh and not much worse than another."""
        if self.chosen is None or len(self.paths) > 1:
            best = min(self.paths, key=lambda key: self._badness(key, now_s), default=None)
            if best != self.chosen:
                self.changes += self.chosen is not None
                self.chosen = best
        return self.chosen

    def _badness(self, key: PathKey, now_s: float) -> tuple[bool, bool, float]:
        """A path that has answered nothing may carry nothing back: it takes over from none that is fresh."""
        quality = self.paths[key].quality(now_s)
        stale = quality.age_s > STALE_S
        is_chosen = key == self.chosen
        mute = self.chosen is not None and not is_chosen and quality.round_trip_s is None
        return stale, mute, quality.age_s if stale else quality.loss - BETTER_LOSS * is_chosen

    def rivals(self, now_s: float) -> list[PathKey]:
        """Paths that are alive and lead to another vehicle than the chosen one, which has the same system id."""
        mine = self.paths.get(self.chosen) if self.chosen is not None else None
        if mine is None or len(self.paths) < 2 or now_s - mine.heard_s > LIVE_S:
            return []
        return [
            key
            for key, path in self.paths.items()
            if key != self.chosen and now_s - path.heard_s <= LIVE_S and _differ(mine, path)
        ]

    def is_stranger(self, key: PathKey, now_s: float) -> bool:
        """Who comes this way has not told its clock, and the vehicle that has is heard elsewhere: is it the same?"""
        mine = self.paths.get(self.chosen) if self.chosen is not None else None
        if mine is None or key == self.chosen or now_s - mine.heard_s > LIVE_S:
            return False
        return mine.boot_clock_s is not None and self.paths[key].boot_clock_s is None


def _differ(one: Path, other: Path) -> bool:
    if one.hardware_id and other.hardware_id and one.hardware_id != other.hardware_id:
        return True
    if one.boot_clock_s is None or other.boot_clock_s is None:
        return False
    return abs(one.boot_clock_s - other.boot_clock_s) > CLOCK_TOLERANCE_S
