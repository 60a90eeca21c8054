"""Detours: pieces of a guide that are blocked, and what replaces them."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from companion.planner.grid_search import straighten, way_around
from companion.planner.guide import MERGED_M, SAMPLES_PER_HORIZON, Guide, dense
from companion.planner.limits import FlightLimits, Surroundings, ends_of, free_space, lacking
from companion.planner.reference import LEG_SPEED, Way
from missions.kernels import compiled

Array = npt.NDArray[np.float64]

WIDER_AROUND_OBSTACLES = 3.0
"""Where the guide itself is only a rough way around something, the corridor is so many times as wide."""
MAX_DETOURS = 20
FIRST_WHERE_IT_IS_WIDE = ((True, False), (True, True), (False, False), (False, True))
"""In which order ways are looked for: beside things alone, through narrow places."""
WIDER_BOX = 3.0
"""Ways through narrow places are looked for so many times as far around."""


def lead_around(
    guide: Guide,
    around: Surroundings,
    limits: FlightLimits,
    horizon_m: float,
    cell_m: float,
    from_m: float = 0.0,
    place_m: Array | None = None,
    *,
    strictly: bool = False,
    quick: bool = False,
) -> Guide | None:
    """The guide with its blocked pieces replaced by ways around; None when there is no way.

    Args:
        guide: what is followed.
        around: what may block it.
        limits: what is kept.
        horizon_m: nearer than this a way around begins where the vehicle is.
        cell_m: of the grid on which ways around are looked for.
        from_m: how much of the guide is done [m].
        place_m: (3,) where the vehicle is; without it, on the guide.
        strictly: pieces that lack less than the reserve are blocked as well; usually plans find room beside them.
        quick: searches give up early, as who is in flight has to.
    """
    slack_m, led_m = 0.0 if strictly else limits.reserve_m, from_m
    for _ in range(MAX_DETOURS):
        piece = first_blocked_piece(guide.way, around, limits, led_m, slack_m)
        if piece is None:
            return guide
        detoured = _with_detour(guide, piece, around, limits, horizon_m, cell_m, from_m, place_m, quick=quick)
        if detoured is None:
            return None
        guide, led_m, anew = detoured
        if anew:
            from_m, place_m = 0.0, None
    return guide


def first_blocked_piece(
    way: Way, around: Surroundings, limits: FlightLimits, from_m: float = 0.0, slack_m: float = 0.0
) -> tuple[int, int] | None:
    """(first, last) sample indices of the first piece of a way that lacks clearance or height; None when all is clear.

    Blocked samples so near to each other that their detours would meet are one piece.
    """
    first, last = find_blocked(way, from_m, 4.0 * _pull_m(limits), slack_m, around, limits)
    return None if first < 0 else (int(first), int(last))


@compiled
def find_blocked(
    way: Way, from_m: float, gap_m: float, slack_m: float, around: Surroundings, limits: FlightLimits
) -> tuple[int, int]:
    """`first_blocked_piece` behind an arc, compiled: pieces less than `gap_m` apart are one; (-1, -1) without any."""
    m, first, last = len(way.arc_m), -1, -1
    begin = min(int(np.searchsorted(way.arc_m, from_m)), m - 1)
    ends = ends_of(way.samples[begin, :3], way.samples[m - 1, :3], around, limits)
    blocked = mark_blocked(way.samples[begin:], ends, slack_m, around, limits)
    for i in range(begin, m):
        if blocked[i - begin]:
            if first >= 0 and way.arc_m[i] - way.arc_m[last] > gap_m:
                break
            first, last = (i if first < 0 else first), i
    return first, last


def blocked_samples(points_m: Array, around: Surroundings, limits: FlightLimits) -> npt.NDArray[np.bool_]:
    """(m,) which of (m, 3) points lack clearance, height or flight range, eased near the first and the last one."""
    points_m = np.ascontiguousarray(points_m)
    ends = ends_of(points_m[0].copy(), points_m[-1].copy(), around, limits)
    return mark_blocked(points_m, ends, 0.0, around, limits)


@compiled
def mark_blocked(
    points_m: Array, ends: Array, slack_m: float, around: Surroundings, limits: FlightLimits
) -> npt.NDArray[np.bool_]:
    """`blocked_samples`, compiled; those that lack less than `slack_m` are not."""
    free_m, lacking_m, scarce_m = np.empty(len(points_m)), np.empty(len(points_m)), np.empty(len(points_m))
    free_space(points_m, 0.0, around, free_m)
    lacking(points_m, free_m + slack_m, 0.0, around, ends, limits, lacking_m, scarce_m)
    return lacking_m > 0.0


def _with_detour(
    guide: Guide,
    piece: tuple[int, int],
    around: Surroundings,
    limits: FlightLimits,
    horizon_m: float,
    cell_m: float,
    from_m: float,
    place_m: Array | None,
    *,
    quick: bool,
) -> tuple[Guide, float, bool] | None:
    """The guide with one blocked piece, and some of the way before and behind it, replaced; and where this ends [m].

    A detour is not looked at again: where it is as narrow as what it leads around, another one would be no better. A
    piece that is near is passed from where the vehicle is, and the guide begins there; then True.
    """
    way = guide.way
    if piece[1] == len(way.arc_m) - 1:
        return None
    blocked = blocked_samples(way.points_m, around, limits)
    near = way.arc_m[piece[0]] - from_m < horizon_m
    a = max(int(np.searchsorted(way.arc_m, from_m, side="right")) - 1, 0) if near else _leave(way, piece, limits)
    begin_m = place_m if near and place_m is not None else way.points_m[a]
    rejoin = list(_rejoin(guide, piece, blocked, a, horizon_m, limits))
    for b, corners in _ways(begin_m, guide, rejoin, cell_m, limits, around, quick=quick):
        if len(corners):
            b, detour = _detour(guide, a, b, corners, around, limits, horizon_m, cell_m)
            led_m = float(detour.arc_m[-1])
            if near:
                return _begun_anew(guide, a, b, detour), led_m, True
            return _spliced(guide, a, b, detour), float(way.arc_m[a]) + led_m, False
    return None


def _leave(way: Way, piece: tuple[int, int], limits: FlightLimits) -> int:
    """Where to leave a way before a blocked piece that is far off."""
    a = piece[0] - 1
    while a > 0 and way.arc_m[piece[0]] - way.arc_m[a] < _pull_m(limits):
        a -= 1
    return max(a, 0)


def _rejoin(
    guide: Guide, piece: tuple[int, int], blocked: npt.NDArray[np.bool_], a: int, horizon_m: float, limits: FlightLimits
) -> Iterator[int]:
    """Samples at which a detour may come back: at the horizon, at the next track point, soon after the piece.

    A track point that is far off comes last: unlike the others, it is not in a pocket that nothing leads to.
    """
    arcs, nearest = guide.way.arc_m, piece[1] + 1
    while nearest < len(arcs) - 1 and arcs[nearest] - arcs[piece[1]] < _pull_m(limits) and not blocked[nearest + 1]:
        nearest += 1
    next_point = _next_point(guide, nearest)
    for index in range(int(np.searchsorted(arcs, float(arcs[a]) + horizon_m)), next_point):
        if index > nearest and not blocked[index]:
            yield index
            break
    onwards = [next_point] if next_point > nearest and not blocked[next_point] else []
    yield from onwards + [nearest] if arcs[next_point] - arcs[a] < 2.0 * horizon_m else [nearest] + onwards


def _next_point(guide: Guide, index: int) -> int:
    """Sample of the first track point that is not before a sample."""
    arcs = guide.way.arc_m
    track = int(np.searchsorted(guide.track_arc_m, float(arcs[index]) - MERGED_M))
    arc_m = float(guide.track_arc_m[min(track, len(guide.track_arc_m) - 1)])
    return min(int(np.searchsorted(arcs, arc_m - MERGED_M)), len(arcs) - 1)


def _ways(
    begin_m: Array,
    guide: Guide,
    rejoin: list[int],
    cell_m: float,
    limits: FlightLimits,
    around: Surroundings,
    *,
    quick: bool,
) -> Iterator[tuple[int, Array]]:
    """Samples of the guide, and (m, 3) corners of a way to each, (0, 3) without one: first beside things, then over.

    Who is in flight has time to look for one way over things, to the first of the samples.
    """
    for flat, narrow in FIRST_WHERE_IT_IS_WIDE[: 3 if quick else 4]:
        for b in rejoin if flat or not quick else rejoin[:1]:
            end_m = guide.way.points_m[b].copy()
            room_m = max(0.3 * float(np.linalg.norm(end_m - begin_m)), 4.0 * _pull_m(limits))
            room_m *= WIDER_BOX if narrow else 1.0
            yield b, way_around(begin_m, end_m, room_m, cell_m, limits, around, narrow=narrow, flat=flat, quick=quick)


def _detour(
    guide: Guide,
    a: int,
    b: int,
    corners: Array,
    around: Surroundings,
    limits: FlightLimits,
    horizon_m: float,
    cell_m: float,
) -> tuple[int, Way]:
    """The sample at which it ends, and the detour; it goes straight on to the next track point where that is clear."""
    way, next_point = guide.way, _next_point(guide, b)
    end_m = way.points_m[next_point].copy()
    ends = ends_of(corners[0].copy(), end_m, around, limits)
    if next_point > b and not blocked_samples(way.points_m[b : next_point + 1], around, limits).any():
        rest = np.vstack((corners, end_m))
        straight = straighten(rest, cell_m, limits, around, ends)
        if len(straight) < len(rest):
            corners, b = straight, next_point
    legs = np.full(len(corners), way.samples[a : b + 1, LEG_SPEED].max())
    corridor_m = WIDER_AROUND_OBSTACLES * limits.corridor_m
    return b, dense(corners, legs, corridor_m, horizon_m / SAMPLES_PER_HORIZON)


def _pull_m(limits: FlightLimits) -> float:
    """How far before and behind a blocked piece its detour begins and ends [m]."""
    return limits.avoidance_distance_m + limits.clearance_m


def _begun_anew(guide: Guide, a: int, b: int, detour: Way) -> Guide:
    """A guide that begins with a detour and goes on behind the b-th sample of the old one."""
    before_m = float(guide.way.arc_m[a])
    passed = min(int(np.searchsorted(guide.track_arc_m, before_m + MERGED_M)), len(guide.track_arc_m) - 1)
    spliced = _spliced(guide, a, b, detour)
    way = Way(np.ascontiguousarray(spliced.way.samples[a:]), spliced.way.arc_m[a:] - before_m)
    return Guide(way, spliced.track_arc_m[passed:] - before_m, guide.first_index + passed)


def _spliced(guide: Guide, a: int, b: int, detour: Way) -> Guide:
    """The guide with its samples from a to b replaced; track points that lay on them keep their share of the way."""
    way, arcs = guide.way, guide.way.arc_m
    length_m = float(detour.arc_m[-1])
    longer_m = length_m - (arcs[b] - arcs[a])
    spliced = Way(
        np.vstack((way.samples[:a], detour.samples, way.samples[b + 1 :])),
        np.concatenate((arcs[:a], arcs[a] + detour.arc_m, arcs[b + 1 :] + longer_m)),
    )
    old = np.array([0.0, arcs[a], arcs[b], arcs[-1]])
    new = np.array([0.0, arcs[a], arcs[a] + length_m, arcs[-1] + longer_m])
    return Guide(spliced, np.interp(guide.track_arc_m, old, new), guide.first_index)
