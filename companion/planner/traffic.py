"""What moves, in time: neighbours along their trajectories and movers straight on, as compiled code reads them."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from companion.fleet.neighbour import Neighbour
from companion.mapping.movers import Mover
from missions.kernels import compiled
from missions.mission import Limits
from missions.obstacles import FAR_M

Array = npt.NDArray[np.float64]

PLACES = 64
"""Moments at which everybody's place is written down."""
PREDICTED_S = 3.0
"""Movers are expected to go straight on for so long."""
GROWTH_M_S, MOST_GROWTH_M = 0.1, 0.25
"""What is predicted grows, for it may turn."""
PARTING_M_S, PARTING_AFTER_S = 0.3, 1.0
"""Who is nearer to a neighbour than allowed comes no nearer, and leaves it at least this fast once it has set out."""

RADIUS, APART, TOUCHING, HAD = range(4)
"""Columns of a body: radius of a mover (0 for a neighbour); distance to be kept to a neighbour (0 for a mover), and in
launch zones; what there is of it when the plan begins [m]."""


class Traffic(NamedTuple):
    """Everybody's places at equal time steps from one moment on."""

    places_m: Array
    """(b, PLACES, 3) ENU."""
    bodies: Array
    """(b, 4) RADIUS, APART, TOUCHING, HAD."""
    step_s: float


def no_traffic() -> Traffic:
    """Nobody about."""
    return Traffic(np.zeros((0, PLACES, 3)), np.zeros((0, 4)), 1.0)


def traffic(
    movers: tuple[Mover, ...],
    neighbours: tuple[Neighbour, ...],
    limits: Limits,
    begin_s: float,
    duration_s: float,
    place_m: Array,
) -> Traffic:
    """Where everybody is from `begin_s` on, for `duration_s` [vehicle time].

    Args:
        movers: what the sensor has found.
        neighbours: vehicles that have told what they do.
        limits: separation and body of this vehicle.
        begin_s: when the plan begins.
        duration_s: how long it may last.
        place_m: (3,) where this vehicle is then: who is too near already need not be far off at once.
    """
    if not movers and not neighbours:
        return no_traffic()
    step_s = duration_s / (PLACES - 1)
    places_m = np.empty((len(movers) + len(neighbours), PLACES, 3))
    bodies = np.zeros((len(places_m), 4))
    for row, mover in enumerate(movers):
        ahead_s = begin_s - mover.time_s + step_s * np.arange(PLACES)
        places_m[row] = mover.centre_m + np.minimum(ahead_s, PREDICTED_S)[:, None] * mover.velocity_m_s
        bodies[row, RADIUS] = mover.radius_m
    for row, neighbour in enumerate(neighbours, len(movers)):
        path = neighbour.trajectory
        first = (begin_s - path.start_s) / path.knot_interval_s
        write_places(path.control_points_m, first, step_s / path.knot_interval_s, places_m[row])
        bodies[row, APART] = neighbour.distance_m(limits)
        bodies[row, TOUCHING] = neighbour.radius_m + limits.body_radius_m
    bodies[:, HAD] = np.linalg.norm(places_m[:, 0] - place_m, axis=1)
    return Traffic(places_m, bodies, step_s)


@compiled
def write_places(control: Array, first: float, step: float, places_m: Array) -> None:
    """Write places of a uniform cubic B-spline, `step` segments apart from `first` on, into (m, 3)."""
    for k in range(len(places_m)):
        spline_point(control, first + k * step, places_m[k])


@compiled
def spline_point(control: Array, at_segment: float, out: Array) -> None:
    """Write the point of a uniform cubic B-spline (eq. 21) at a parameter counted in segments into `out` (3,)."""
    segment = min(max(int(at_segment), 0), len(control) - 4)
    u = min(max(at_segment - segment, 0.0), 1.0)
    w0, w3 = (1.0 - u) ** 3 / 6.0, u**3 / 6.0
    w1 = (3.0 * u**3 - 6.0 * u**2 + 4.0) / 6.0
    w2 = (-3.0 * u**3 + 3.0 * u**2 + 3.0 * u + 1.0) / 6.0
    for axis in range(3):
        out[axis] = (
            w0 * control[segment, axis]
            + w1 * control[segment + 1, axis]
            + w2 * control[segment + 2, axis]
            + w3 * control[segment + 3, axis]
        )


@compiled
def body_distance(east: float, north: float, up: float, time_s: float, b: int, moving: Traffic) -> float:
    """Distance [m] from a place to the middle of the b-th body at a time after the plan's beginning [s]."""
    places_m = moving.places_m
    at = min(max(time_s / moving.step_s, 0.0), places_m.shape[1] - 1.001)
    k = int(at)
    share = at - k
    de = east - places_m[b, k, 0] - share * (places_m[b, k + 1, 0] - places_m[b, k, 0])
    dn = north - places_m[b, k, 1] - share * (places_m[b, k + 1, 1] - places_m[b, k, 1])
    du = up - places_m[b, k, 2] - share * (places_m[b, k + 1, 2] - places_m[b, k, 2])
    return np.sqrt(de * de + dn * dn + du * du)


@compiled
def mover_clearance(east: float, north: float, up: float, time_s: float, moving: Traffic) -> float:
    """Distance [m] to the nearest mover's surface at a time; `FAR_M` without any."""
    nearest, grown_m = FAR_M, min(GROWTH_M_S * time_s, MOST_GROWTH_M)
    for b in range(len(moving.bodies)):
        if moving.bodies[b, RADIUS] > 0.0:
            off_m = body_distance(east, north, up, time_s, b, moving)
            nearest = min(nearest, off_m - moving.bodies[b, RADIUS] - grown_m)
    return nearest


@compiled
def crowding(east: float, north: float, up: float, time_s: float, in_zone: bool, moving: Traffic) -> float:
    """What lacks of the distances to neighbours at a place and time [m], summed up; less is asked of who has less."""
    lacks = 0.0
    for b in range(len(moving.bodies)):
        apart_m = moving.bodies[b, TOUCHING] if in_zone else moving.bodies[b, APART]
        if apart_m > 0.0:
            apart_m = min(apart_m, moving.bodies[b, HAD] + PARTING_M_S * max(time_s - PARTING_AFTER_S, 0.0))
            lacks += max(apart_m - body_distance(east, north, up, time_s, b, moving), 0.0)
    return lacks
