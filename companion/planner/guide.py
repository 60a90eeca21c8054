"""The guide: what remains of the track from where the vehicle is, as a dense polyline, which `detours` leads around.

A guide changes when a new track arrives and when it turns out to be blocked; replans only read it.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from companion.planner.limits import FlightLimits
from companion.planner.reference import CORNER_SHARE, Way
from missions.mission_items import Track
from missions.time_law import arc_length, resample
from missions.trajectory import Motion

Array = npt.NDArray[np.float64]

SAMPLES_PER_HORIZON = 60
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
    way = dense(vertices, legs, limits.corridor_m, horizon_m / SAMPLES_PER_HORIZON)
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


def dense(vertices: Array, legs_m_s: Array, corridor_m: float, spacing_m: float) -> Way:
    """A way through (v, 3) vertices with (v,) speeds of the legs to them, sampled at least every `spacing_m`."""
    corners = arc_length(vertices)
    length_m = float(corners[-1])
    even = np.linspace(0.0, length_m, max(int(np.ceil(length_m / spacing_m)), 1) + 1)
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
