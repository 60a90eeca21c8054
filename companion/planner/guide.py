"""The guide: what remains of the track from where the vehicle is, as a dense polyline, led around what blocks it.

A guide changes when a new track arrives and when it turns out to be blocked; replans only read it.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from companion.planner.grid_search import straighten, way_around
from companion.planner.limits import FlightLimits, Surroundings, ends_of, free_space, lacking
from companion.planner.reference import CORNER_SHARE, LEG_SPEED, Way
from missions.kernels import compiled
from missions.mission_items import Track
from missions.time_law import arc_length, resample
from missions.trajectory import Motion

Array = npt.NDArray[np.float64]

SAMPLES_PER_HORIZON = 60
WIDER_AROUND_OBSTACLES = 3.0
"""Where the guide itself is only a rough way around something, the corridor is so many times as wide."""
JOIN_AHEAD = 1.0
"""Who is beside the track joins it this multiple of the distance ahead."""
NEARLY_AS_NEAR_M = 0.3
"""Of several places on the track that are about as near, the earliest is joined."""
CORNER_REACH = 4.0
"""Corners are rounded within so many corridor widths to both sides."""
RUN_OUT_SHARE = 1.4
"""Who flies another way runs out on the old course for so many times what braking and rounding the corner take."""
GENTLE_TURN = 2.0
"""A corner that could be flown so many times as fast needs no run-out."""
MAX_DETOURS = 20
MERGED_M = 1e-3
"""Points nearer to each other are one."""
STANDING_M_S = 0.15
"""Slower than this a vehicle can go anywhere."""


@dataclass(frozen=True)
class Guide:
    """The way that remains.

    Args:
        way: (m, 3) points about as far apart as a sixtieth of the horizon, with arcs, speeds and corridors.
        track_arc_m: (k,) arc of each track point that remains.
        first_index: the index of the first of these in the track.
    """

    way: Way
    track_arc_m: Array
    first_index: int

    @property
    def length_m(self) -> float:
        return float(self.way.arc_m[-1])

    @property
    def end_m(self) -> Array:
        """(3,) the target."""
        return self.way.points_m[-1]

    def point(self, arc_m: float) -> Array:
        """(3,) the point at an arc [m]."""
        return resample(self.way.points_m, self.way.arc_m, np.array([arc_m]))[0]

    def project(self, point_m: Array, from_arc_m: float, reach_m: float) -> float:
        """Arc [m] of the nearest point on the piece of length `reach_m` that begins at `from_arc_m`."""
        arcs = self.way.arc_m
        first = max(int(np.searchsorted(arcs, from_arc_m, side="right")) - 1, 0)
        last = min(int(np.searchsorted(arcs, from_arc_m + reach_m)) + 1, len(arcs))
        arc_m, _ = nearest_on(self.way.points_m[first:last], arcs[first:last], point_m)
        return min(max(arc_m, from_arc_m), self.length_m)

    def next_index(self, arc_m: float) -> int:
        """Index, in the track, of the next point that is not yet passed at an arc [m]; the last one at the end."""
        passed = int(np.searchsorted(self.track_arc_m, arc_m + 1e-6, side="right"))
        return self.first_index + min(passed, len(self.track_arc_m) - 1)


def lay_guide(
    track: Track, index: int, from_m: Array, horizon_m: float, limits: FlightLimits, over_m: Array | None = None
) -> Guide:
    """The guide from a place along what remains of a track.

    Args:
        track: the whole track.
        index: of the track point that is flown to; what lies before the one before it is done.
        from_m: (3,) where the guide begins, ENU [m].
        horizon_m: sets how dense the guide is.
        limits: speeds and corridor.
        over_m: (3,) where it passes before it joins the track, see `run_out`.
    """
    lead_in_m = from_m[None] if over_m is None else np.vstack((from_m, over_m))
    first, points, legs = _remaining(track, index, lead_in_m[-1], limits)
    legs = np.where(np.isnan(legs), limits.cruise_m_s, legs)
    vertices = np.vstack((lead_in_m, points))
    legs = np.concatenate((np.repeat(legs[:1], len(lead_in_m)), legs))
    way = _dense(vertices, legs, limits.corridor_m, horizon_m / SAMPLES_PER_HORIZON)
    n_track_points = len(track.points_m) - first
    return Guide(way, arc_length(vertices)[-n_track_points:], first)


def run_out(track: Track, index: int, start: Motion, limits: FlightLimits) -> Array | None:
    """(3,) how far a vehicle goes on as it moves before it turns towards a track; None where it can turn at once.

    A guide that begins with a sharp corner at speed cannot be flown; with this place on it, it can.

    Args:
        track: the whole track.
        index: of the track point that is flown to.
        start: the state from which the track is joined, ENU.
        limits: of acceleration, and the corridor in which corners are rounded.
    """
    place_m, velocity_m_s, acceleration_m_s2 = start
    speed_m_s = float(np.linalg.norm(velocity_m_s))
    if speed_m_s < STANDING_M_S:
        return None
    onwards_m = _remaining(track, index, place_m, limits)[1][0] - place_m
    ahead, reach_m = velocity_m_s / speed_m_s, CORNER_REACH * limits.corridor_m
    onwards_m = onwards_m / max(float(np.linalg.norm(onwards_m)), MERGED_M)
    corner_m = place_m + reach_m * np.array([-ahead, np.zeros(3), onwards_m])
    corner_m_s = corner_speeds(corner_m, reach_m * np.arange(3.0), reach_m, limits)[1]
    settling_s = 0.5 * limits.acceleration_m_s2 / limits.jerk_m_s3
    fastest_m_s = speed_m_s + settling_s * max(float(acceleration_m_s2 @ ahead), 0.0)
    if corner_m_s >= GENTLE_TURN * fastest_m_s:
        return None
    braking_m = max(fastest_m_s**2 - corner_m_s**2, 0.0) / (2.0 * limits.braking_m_s2)
    return place_m + RUN_OUT_SHARE * (braking_m + reach_m) * ahead


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
    """
    slack_m = 0.0 if strictly else limits.reserve_m
    for _ in range(MAX_DETOURS):
        piece = first_blocked_piece(guide.way, around, limits, from_m, slack_m)
        if piece is None:
            return guide
        detoured = _with_detour(guide, piece, around, limits, horizon_m, cell_m, from_m, place_m)
        if detoured is None:
            return None
        guide, anew = detoured
        if anew:
            from_m, place_m = 0.0, None
    return None


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


def nearest_on(points_m: Array, arc_m: Array, point_m: Array) -> tuple[float, float]:
    """(arc, distance) [m] of the point of a polyline nearest to `point_m`; the earliest of about equally near ones."""
    if len(points_m) == 1:
        return float(arc_m[0]), float(np.linalg.norm(points_m[0] - point_m))
    sides = np.diff(points_m, axis=0)
    squared = np.maximum(np.einsum("ij,ij->i", sides, sides), 1e-12)
    share = np.clip(np.einsum("ij,ij->i", point_m - points_m[:-1], sides) / squared, 0.0, 1.0)
    distances = np.linalg.norm(points_m[:-1] + share[:, None] * sides - point_m, axis=1)
    near = distances <= distances.min() + NEARLY_AS_NEAR_M
    first = int(np.argmax(near))
    after = first + int(np.argmin(np.append(near[first:], False)))  # the first run of sides that are near
    best = first + int(np.argmin(distances[first:after]))
    return float(arc_m[best] + share[best] * (arc_m[best + 1] - arc_m[best])), float(distances[best])


def _remaining(track: Track, index: int, from_m: Array, limits: FlightLimits) -> tuple[int, Array, Array]:
    """Index of the first track point that remains; (k, 3) points to fly to, and (k,) speeds of the legs to them."""
    begin = max(index - 1, 0)
    points, speeds = track.points_m[begin:], track.speeds_m_s[begin:]
    arcs = arc_length(points)
    nearest_arc, off_m = nearest_on(points, arcs, from_m)
    if nearest_arc == 0.0:  # before this piece of the track: straight to the point that is flown to
        return index, points[index - begin :], speeds[index - begin :]
    join_arc = nearest_arc + JOIN_AHEAD * off_m
    first = min(int(np.searchsorted(arcs, join_arc + MERGED_M)), len(points) - 1)
    remaining, legs = points[first:], speeds[first:]
    if off_m > limits.corridor_m and join_arc < arcs[-1]:
        remaining = np.vstack((resample(points, arcs, np.array([join_arc])), remaining))
        legs = np.concatenate((legs[:1], legs))
    return begin + first, remaining, legs


def _dense(vertices: Array, legs_m_s: Array, corridor_m: float, spacing_m: float) -> Way:
    """A way through (v, 3) vertices with (v,) speeds of the legs to them, sampled at least every `spacing_m`."""
    corners = arc_length(vertices)
    even = np.linspace(0.0, corners[-1], max(int(np.ceil(corners[-1] / spacing_m)), 1) + 1)
    arcs = np.unique(np.concatenate((even, corners)))
    points = resample(vertices, corners, arcs)
    leg = np.minimum(np.searchsorted(corners, arcs, side="left"), len(vertices) - 1)
    return Way(np.column_stack((points, legs_m_s[leg], np.full(len(arcs), corridor_m))), arcs)


def corner_speeds(points_m: Array, arc_m: Array, reach_m: float, limits: FlightLimits) -> Array:
    """(m,) speeds [m/s] at which a polyline's turns, rounded within `reach_m` to both sides, can be flown."""
    behind = resample(points_m, arc_m, np.maximum(arc_m - reach_m, 0.0))
    ahead = resample(points_m, arc_m, np.minimum(arc_m + reach_m, arc_m[-1]))
    to_here, onwards = points_m - behind, ahead - points_m
    across = np.linalg.norm(np.cross(to_here, onwards), axis=1)
    angle = np.arctan2(across, np.einsum("ij,ij->i", to_here, onwards))
    length_m = 0.5 * (np.linalg.norm(to_here, axis=1) + np.linalg.norm(onwards, axis=1))
    curvature = angle / np.maximum(length_m, 1e-6)
    return np.sqrt(CORNER_SHARE * limits.acceleration_m_s2 / np.maximum(curvature, 1e-6))


def _with_detour(
    guide: Guide,
    piece: tuple[int, int],
    around: Surroundings,
    limits: FlightLimits,
    horizon_m: float,
    cell_m: float,
    from_m: float,
    place_m: Array | None,
) -> tuple[Guide, bool] | None:
    """The guide with one blocked piece, and some of the way before and behind it, replaced.

    A piece that is near is passed from where the vehicle is, and the guide begins there; then True.
    """
    way = guide.way
    if piece[1] == len(way.arc_m) - 1:
        return None
    blocked = blocked_samples(way.points_m, around, limits)
    near = way.arc_m[piece[0]] - from_m < horizon_m
    a = max(int(np.searchsorted(way.arc_m, from_m, side="right")) - 1, 0) if near else _leave(way, piece, limits)
    begin_m = place_m if near and place_m is not None else way.points_m[a]
    for b in _rejoin(guide, piece, blocked, a, horizon_m, limits):
        corners = _corners(begin_m, guide, b, limits, around, cell_m)
        if len(corners):
            detour = _detour(guide, a, b, corners, around, limits, horizon_m, cell_m)
            return (_begun_anew(guide, a, *detour), True) if near else (_spliced(guide, a, *detour), False)
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
    """Samples at which a detour may come back: at the horizon, at the next track point, soon after the piece."""
    arcs, nearest = guide.way.arc_m, piece[1] + 1
    while nearest < len(arcs) - 1 and arcs[nearest] - arcs[piece[1]] < _pull_m(limits) and not blocked[nearest + 1]:
        nearest += 1
    next_point = _next_point(guide, nearest)
    for index in range(int(np.searchsorted(arcs, arcs[a] + horizon_m)), next_point):
        if index > nearest and not blocked[index]:
            yield index
            break
    if next_point > nearest and arcs[next_point] - arcs[a] < 2.0 * horizon_m and not blocked[next_point]:
        yield next_point
    yield nearest


def _next_point(guide: Guide, index: int) -> int:
    """Sample of the first track point that is not before a sample."""
    arcs = guide.way.arc_m
    track = int(np.searchsorted(guide.track_arc_m, arcs[index] - MERGED_M))
    arc_m = guide.track_arc_m[min(track, len(guide.track_arc_m) - 1)]
    return min(int(np.searchsorted(arcs, arc_m - MERGED_M)), len(arcs) - 1)


def _corners(begin_m: Array, guide: Guide, b: int, limits: FlightLimits, around: Surroundings, cell_m: float) -> Array:
    """(m, 3) corners of a way to a sample of the guide; (0, 3) when there is none."""
    end_m = guide.way.points_m[b].copy()
    room_m = max(0.3 * float(np.linalg.norm(end_m - begin_m)), 4.0 * _pull_m(limits))
    corners = way_around(begin_m, end_m, room_m, cell_m, limits, around)
    return corners if len(corners) else way_around(begin_m, end_m, 3.0 * room_m, cell_m, limits, around, narrow=True)


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
    return b, _dense(corners, legs, corridor_m, horizon_m / SAMPLES_PER_HORIZON)


def _pull_m(limits: FlightLimits) -> float:
    """How far before and behind a blocked piece its detour begins and ends [m]."""
    return limits.avoidance_distance_m + limits.clearance_m


def _begun_anew(guide: Guide, a: int, b: int, detour: Way) -> Guide:
    """A guide that begins with a detour and goes on behind the b-th sample of the old one."""
    passed = min(int(np.searchsorted(guide.track_arc_m, guide.way.arc_m[a] + MERGED_M)), len(guide.track_arc_m) - 1)
    spliced = _spliced(guide, a, b, detour)
    before_m = guide.way.arc_m[a]
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
