"""The lines that change while vehicles fly: where they have been, and what lies ahead of them; pure.

The whole fleet's lines are a few arrays. What moves keeps its shape, so that it is cheap to send: segments that are
not needed have no length. What has been flown is sealed in chunks, thinned, and never sent again but for merging.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from gcs.fleet.vehicle_state import LINK_TIMEOUT_S, CompanionView
from gcs.flight.trails import Trail
from missions.bspline import uniform_rows
from missions.tunnel import CompanionState

Array = npt.NDArray[np.float64]
Segments = npt.NDArray[np.float32]
"""As they are sent."""
Colours = npt.NDArray[np.uint8]

CHUNK = 10
"""Points of a trail that stay live; when there are more, they are sealed."""
AHEAD, AHEAD_OF_MANY = 16, 8
"""Points of the line that shows what a companion is about to fly; of a large fleet's, fewer."""
BATCH, MERGE, MOST_SEGMENTS = 320, 8, 2_560
"""Sealed segments go out in batches; `MERGE` batches become one line, until it has more than `MOST_SEGMENTS`."""
MOST_OF_ALL = 8_000
"""Segments of all lines; the oldest ones are taken away then, so that a browser can come late in any flight.

Each is six triangles: this many are 50 000, for which a machine without a graphics card takes some tenths of a second.
"""
CATCH_UP = 6
"""Of a trail that has grown by no more points than this since the last look, the newest one is enough."""

STEERING = {CompanionState.ENGAGING, CompanionState.FLYING, CompanionState.LANDING}


class FleetTrails:
    """The trails of all vehicles of an order.

    Args:
        count: how many vehicles.
        spacing_m: points nearer than this to the one before are left out.
    """

    def __init__(self, count: int, spacing_m: float) -> None:
        self._spacing_m = spacing_m
        self._tails_m = np.zeros((count, CHUNK, 3))
        self._live, self._read = np.zeros(count, dtype=int), np.zeros(count, dtype=int)

    def take(self, trails: Sequence[Trail | None]) -> list[tuple[int, Array]]:
        """Take in new samples; (vehicle's index, (CHUNK + 1, 3) points) for each chunk that has become full."""
        counts = np.array([len(trail.times_s) if trail is not None else 0 for trail in trails], dtype=int)
        late: list[list[tuple[int, Array]]] = []
        for index in np.flatnonzero(counts - self._read > CATCH_UP).tolist():
            trail = trails[index]
            assert trail is not None
            late.append(self._catch_up(index, trail.positions_m(self._read[index])))
            self._read[index] = counts[index]
        chunks = _oldest_first(late)
        grown = np.flatnonzero(counts > self._read)
        if len(grown):
            newest = [trail.newest_m for index in grown.tolist() if (trail := trails[index]) is not None]
            chunks += self._append(grown, np.array(newest))
            self._read[grown] = counts[grown]
        return chunks

    def segments(self, positions_m: Array) -> Segments:
        """(n * CHUNK, 2, 3) what is not sealed yet, up to where the vehicles (n, 3) are."""
        filled = (np.arange(CHUNK) < self._live[:, None])[..., None]
        return _joined(np.where(filled, self._tails_m, positions_m[:, None]), positions_m[:, None])

    def _catch_up(self, index: int, points_m: Array) -> list[tuple[int, Array]]:
        """Take in (n, 3) points of one vehicle's past at once, thinned to the spacing along its way."""
        tail_m = self._tails_m[index, : self._live[index]]
        begun_m = tail_m[-1:] if len(tail_m) else points_m[:1]
        along_m = np.cumsum(np.linalg.norm(np.diff(points_m, axis=0, prepend=begun_m), axis=1))
        marks_m = np.arange(0.0 if not len(tail_m) else self._spacing_m, along_m[-1] + 1e-9, self._spacing_m)
        chosen = np.unique(np.searchsorted(along_m, marks_m))
        way_m = np.concatenate((tail_m, points_m[chosen]))
        starts = range(0, len(way_m) - CHUNK, CHUNK)
        chunks = [(index, way_m[start : start + CHUNK + 1]) for start in starts]
        rest_m = way_m[len(chunks) * CHUNK :]
        self._tails_m[index, : len(rest_m)], self._live[index] = rest_m, len(rest_m)
        return chunks

    def _append(self, indices: npt.NDArray[np.int64], points_m: Array) -> list[tuple[int, Array]]:
        live = self._live[indices]
        steps_m = np.linalg.norm(points_m - self._tails_m[indices, live - 1], axis=1)
        far = (live == 0) | (steps_m >= self._spacing_m)
        indices, points_m, live = indices[far], points_m[far], live[far]
        full = live == CHUNK
        chunks = [
            (int(index), np.concatenate((self._tails_m[index], point_m[None])))
            for index, point_m in zip(indices[full], points_m[full], strict=True)
        ]
        live = np.where(full, 0, live)
        self._tails_m[indices, live] = points_m
        self._live[indices] = live + 1
        return chunks


def _oldest_first(late: list[list[tuple[int, Array]]]) -> list[tuple[int, Array]]:
    """The chunks of several vehicles in one row, as they would have come while the vehicles flew."""
    longest = max((len(own) for own in late), default=0)
    return [own[-back] for back in range(longest, 0, -1) for own in late if len(own) >= back]


def thinned(chunks_m: Array, tolerance_m: float) -> npt.NDArray[np.bool_]:
    """Which of (k, m, 3) points of k lines are needed; not those about on the way between their neighbours.

    A point halfway between two that stay may go once all others between them have gone.
    """
    needed = np.ones(chunks_m.shape[:2], dtype=bool)
    step = 1
    points = int(chunks_m.shape[1])
    while 2 * step < points:
        middles = np.arange(step, points - step, 2 * step)
        chords_m = (chunks_m[:, middles - step] + chunks_m[:, middles + step]) / 2
        spare = np.linalg.norm(chunks_m[:, middles] - chords_m, axis=2) < tolerance_m
        for beside in (*range(1 - step, 0), *range(1, step)):
            spare &= ~needed[:, middles + beside]
        needed[:, middles] = ~spare
        step *= 2
    return needed


def joined_where(chunks_m: Array, needed: npt.NDArray[np.bool_]) -> tuple[Array, npt.NDArray[np.int64]]:
    """(n, 2, 3) segments along the needed ones of (k, m, 3) points, and (n,) of which line each is."""
    points_m, of_line = chunks_m[needed], np.nonzero(needed)[0]
    same = of_line[1:] == of_line[:-1]
    return np.stack((points_m[:-1][same], points_m[1:][same]), axis=1), of_line[1:][same]


@dataclass(frozen=True, eq=False)
class SealedLine:
    """A line that has been sealed: (n, 2, 3) segments [m] and the (n, 2, 3) colours of their ends."""

    name: str
    segments: Array
    colours: Colours
    rank: int
    """How often it was merged."""


@dataclass
class SealedLines:
    """What has been flown, as few lines: a batch that fills, and batches of batches."""

    batch: Array = field(default_factory=lambda: np.zeros((BATCH, 2, 3)))
    colours: Colours = field(default_factory=lambda: np.zeros((BATCH, 2, 3), dtype=np.uint8))
    """The batch that is being filled; segments behind the last one have no length."""
    _filled: int = 0
    _lines: list[SealedLine] = field(default_factory=list[SealedLine])
    _names: int = 0

    def add(self, segments: Array, colours: Colours) -> tuple[list[SealedLine], list[SealedLine]]:
        """Seal (n, 2, 3) segments of (n, 3) colours; the lines that are new by that, and those that are no more."""
        new: list[SealedLine] = []
        gone: list[SealedLine] = []
        while len(segments):
            if self._filled == BATCH:
                self._settle(new, gone)
            room = BATCH - self._filled
            end = self._filled + len(segments[:room])
            self.batch[self._filled : end] = segments[:room]
            self.batch[end:] = segments[:room][-1, 1]
            self.colours[self._filled : end] = colours[:room, None]
            self._filled, segments, colours = end, segments[room:], colours[room:]
        return [line for line in new if line not in gone], [line for line in gone if line not in new]

    def _settle(self, new: list[SealedLine], gone: list[SealedLine]) -> None:
        line = self._named(self.batch[: self._filled].copy(), self.colours[: self._filled].copy(), 0)
        while True:
            peers = [other for other in self._lines if other.rank == line.rank]
            if len(peers) < MERGE - 1 or len(line.segments) * MERGE > MOST_SEGMENTS:
                break
            self._lines = [other for other in self._lines if other.rank != line.rank]
            gone += peers
            together = [*peers, line]
            line = self._named(
                np.concatenate([part.segments for part in together]),
                np.concatenate([part.colours for part in together]),
                line.rank + 1,
            )
        self._lines.append(line)
        new.append(line)
        while sum(len(line.segments) for line in self._lines) > MOST_OF_ALL:
            gone.append(self._lines.pop(0))
        self._filled = 0

    def _named(self, segments: Array, colours: Colours, rank: int) -> SealedLine:
        self._names += 1
        return SealedLine(f"{self._names}", segments, colours, rank)


class WaysAhead:
    """What the companions of all vehicles of an order are about to fly.

    Args:
        count: how many vehicles.
        steps: points of each line.
    """

    def __init__(self, count: int, steps: int = AHEAD) -> None:
        self._steps, self._points_m = steps, np.zeros((count, steps, 3))
        self._shown = np.zeros(count, dtype=bool)
        self._revisions: list[int | None] = [None] * count

    def take(self, companions: Sequence[CompanionView], now_s: float) -> None:
        """Take in what they have said last; of those that do not steer, or are silent, nothing is shown."""
        shown, new = list[bool](), dict[int, list[tuple[int, Array]]]()
        for index, companion in enumerate(companions):
            status, trajectory = companion.status, companion.trajectory
            steers = status is not None and status.state in STEERING and now_s - companion.heard_s < LINK_TIMEOUT_S
            shown.append(steers and trajectory is not None)
            if shown[-1] and trajectory is not None and companion.trajectory_revision != self._revisions[index]:
                self._revisions[index] = companion.trajectory_revision
                control_m = trajectory.control_points_m
                new.setdefault(len(control_m), []).append((index, control_m))
        self._shown[:] = shown
        for count, alike in new.items():  # trajectories of as many control points at once
            self._points_m[[index for index, _ in alike]] = _basis(count, self._steps) @ np.array(
                [own for _, own in alike]
            )

    def segments(self, positions_m: Array) -> Segments:
        """(n * steps, 2, 3) of what lies ahead of the vehicles at (n, 3) positions, from each vehicle onwards."""
        points_m = np.where(self._shown[:, None, None], self._points_m, positions_m[:, None])
        away_m = points_m - positions_m[:, None]
        nearest = np.argmin(np.einsum("nak,nak->na", away_m, away_m), axis=1)
        following = np.minimum(nearest[:, None] + 1 + np.arange(self._steps), self._steps - 1)
        return _joined(positions_m[:, None], points_m[np.arange(len(points_m))[:, None], following])


def _joined(first_m: Array, then_m: Array) -> Segments:
    """Segments (n * k, 2, 3) along n polylines of k + 1 points, each given in two parts (n, ., 3)."""
    count, steps = then_m.shape[0], first_m.shape[1] + then_m.shape[1] - 1
    segments = np.empty((count, steps, 2, 3), dtype=np.float32)
    points_m = np.concatenate((first_m, then_m), axis=1)
    segments[:, :, 0], segments[:, :, 1] = points_m[:, :-1], points_m[:, 1:]
    return segments.reshape(-1, 2, 3)


@lru_cache(maxsize=32)
def _basis(count: int, steps: int) -> Array:
    """(steps, count) weights of the control points of a uniform cubic B-spline at equal steps along it."""
    phase = np.linspace(0.0, count - 3, steps)
    segment = np.minimum(phase.astype(int), count - 4)
    weights = np.zeros((steps, count))
    weights[np.arange(steps)[:, None], segment[:, None] + np.arange(4)] = uniform_rows(phase - segment)[0]
    return weights
