"""The guide: what remains of the track from where the vehicle is, as a dense polyline, led around what blocks it.

A guide changes when a new track arrives and when it turns out to be blocked; replans only read it.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from companion.planner.grid_search import BLOCKED, speeds_at, way_around
from companion.planner.limits import FlightLimits, Surroundings, ends_of
from companion.planner.reference import LEG_SPEED, Way
from missions.mission_items import Track
from missions.time_law import arc_length, resample

Array = npt.NDArray[np.float64]

SAMPLES_PER_HORIZON = 60
WIDER_AROUND_OBSTACLES = 3.0
"""Where the guide itself is only a rough way around something, the corridor is so many times as wide."""
JOIN_AHEAD = 1.0
"""Who is beside the track joins it this multiple of the distance ahead."""
NEARLY_AS_NEAR_M = 0.3
"""Of several places on the track that are about as near, the earliest is joined."""
CORNER_SHARE = 0.85
"""Of the highest acceleration may be spent on turning."""
CORNER_REACH = 4.0
"""Corners are rounded within so many corridor widths to both sides."""
MAX_DETOURS = 20
MERGED_M = 1e-3
"""Points nearer to each other are one."""


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


def lay_guide(track: Track, index: int, from_m: Array, horizon_m: float, limits: FlightLimits) -> Guide:
    """The guide from a place along what remains of a track.

    Args:
        track: the whole track.
        index: of the track point that is flown to; what lies before the one before it is done.
        from_m: (3,) where the guide begins, ENU [m].
        horizon_m: sets how dense the guide is.
        limits: speeds and corridor.
    """
    first, points, legs = _remaining(track, index, from_m, limits)
    legs = np.where(np.isnan(legs), limits.cruise_m_s, legs)
    vertices = np.vstack((from_m, points))
    legs = np.concatenate((legs[:1], legs))
    way = _dense(vertices, legs, limits.corridor_m, horizon_m / SAMPLES_PER_HORIZON, limits)
    n_track_points = len(track.points_m) - first
    return Guide(way, arc_length(vertices)[-n_track_points:], first)


def lead_around(
    guide: Guide, around: Surroundings, limits: FlightLimits, horizon_m: float, cell_m: float
) -> Guide | None:
    """The guide with its blocked pieces replaced by ways around; None when there is no way."""
    for _ in range(MAX_DETOURS):
        piece = first_blocked_piece(guide.way, around, limits)
        if piece is None:
            return guide
        detoured = _with_detour(guide, piece, around, limits, horizon_m, cell_m)
        if detoured is None:
            return None
        guide = detoured
    return None


def first_blocked_piece(way: Way, around: Surroundings, limits: FlightLimits) -> tuple[int, int] | None:
    """(first, last) sample indices of the first piece of a way that lacks clearance or height; None when all is clear.

    Blocked samples so near to each other that their detours would meet are one piece.
    """
    blocked = np.flatnonzero(blocked_samples(way.points_m, around, limits))
    if len(blocked) == 0:
        return None
    apart = np.flatnonzero(np.diff(way.arc_m[blocked]) > 4.0 * _pull_m(limits))
    return int(blocked[0]), int(blocked[apart[0] if len(apart) else -1])


def blocked_samples(points_m: Array, around: Surroundings, limits: FlightLimits) -> npt.NDArray[np.bool_]:
    """(m,) which of (m, 3) points lack clearance, height or flight range, eased near the first and the last one."""
    ends = ends_of(points_m[0].copy(), points_m[-1].copy(), around, limits)
    return speeds_at(np.ascontiguousarray(points_m), 0.0, limits, around, ends) == BLOCKED


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


def _dense(vertices: Array, legs_m_s: Array, corridor_m: float, spacing_m: float, limits: FlightLimits) -> Way:
    """A way through (v, 3) vertices with (v,) speeds of the legs to them, sampled at least every `spacing_m`."""
    corners = arc_length(vertices)
    even = np.linspace(0.0, corners[-1], max(int(np.ceil(corners[-1] / spacing_m)), 1) + 1)
    arcs = np.unique(np.concatenate((even, corners)))
    points = resample(vertices, corners, arcs)
    leg = np.minimum(np.searchsorted(corners, arcs, side="left"), len(vertices) - 1)
    speeds = np.minimum(legs_m_s[leg], corner_speeds(points, arcs, CORNER_REACH * corridor_m, limits))
    return Way(np.column_stack((points, speeds, np.full(len(arcs), corridor_m))), arcs)


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
    guide: Guide, piece: tuple[int, int], around: Surroundings, limits: FlightLimits, horizon_m: float, cell_m: float
) -> Guide | None:
    """The guide with one blocked piece, and some of the way before and behind it, replaced."""
    way = guide.way
    if piece[1] == len(way.arc_m) - 1:
        return None
    a, b = _anchors(way, piece, around, limits)
    room_m = max(float(np.linalg.norm(way.points_m[b] - way.points_m[a])), 4.0 * _pull_m(limits))
    corners = way_around(way.points_m[a], way.points_m[b], room_m, cell_m, limits, around)
    if len(corners) == 0:
        return None
    legs = np.full(len(corners), way.samples[a : b + 1, LEG_SPEED].max())
    corridor_m = WIDER_AROUND_OBSTACLES * limits.corridor_m
    detour = _dense(corners, legs, corridor_m, horizon_m / SAMPLES_PER_HORIZON, limits)
    return Guide(_spliced(way, a, b, detour), _moved_arcs(guide, a, b, detour), guide.first_index)


def _anchors(way: Way, piece: tuple[int, int], around: Surroundings, limits: FlightLimits) -> tuple[int, int]:
    """Where to leave and where to rejoin a way around a blocked piece: clear samples, some way off."""
    blocked, pull_m = blocked_samples(way.points_m, around, limits), _pull_m(limits)
    a, b = piece[0] - 1, piece[1] + 1
    while a > 0 and way.arc_m[piece[0]] - way.arc_m[a] < pull_m:
        a -= 1
    while b < len(way.arc_m) - 1 and way.arc_m[b] - way.arc_m[piece[1]] < pull_m and not blocked[b + 1]:
        b += 1
    return max(a, 0), b


def _pull_m(limits: FlightLimits) -> float:
    """How far before and behind a blocked piece its detour begins and ends [m]."""
    return limits.avoidance_distance_m + limits.clearance_m


def _spliced(way: Way, a: int, b: int, detour: Way) -> Way:
    """`way` with its samples from a to b replaced by `detour`, which begins and ends in these two."""
    longer_m = detour.arc_m[-1] - (way.arc_m[b] - way.arc_m[a])
    return Way(
        np.vstack((way.samples[:a], detour.samples, way.samples[b + 1 :])),
        np.concatenate((way.arc_m[:a], way.arc_m[a] + detour.arc_m, way.arc_m[b + 1 :] + longer_m)),
    )


def _moved_arcs(guide: Guide, a: int, b: int, detour: Way) -> Array:
    """Arcs of the track points after a splice; those that lay on the replaced piece keep their share of it."""
    arcs, length_m = guide.way.arc_m, detour.arc_m[-1]
    end_m = arcs[-1] + length_m - (arcs[b] - arcs[a])
    old = np.array([0.0, arcs[a], arcs[b], arcs[-1]])
    new = np.array([0.0, arcs[a], arcs[a] + length_m, end_m])
    return np.interp(guide.track_arc_m, old, new)
