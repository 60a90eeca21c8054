"""What a local plan has to keep, derived from the mission's limits and a reserve, as compiled code reads it."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from companion.mapping.distance_field import Field, distance_at, lower_to_field, no_field
from companion.planner.traffic import Traffic, crowding, mover_clearance, no_traffic
from companion.settings import Reserve
from missions.kernels import compiled
from missions.mission import Mission, Site
from missions.obstacles import Obstacles, clearance_at, fill_clearance, terrain_height_at

Array = npt.NDArray[np.float64]

EASING = 0.5
"""Required clearance and height grow by this much per metre from what the start (or the goal) has."""
EASED_SHARE = 0.5
"""Of what was seen an end counts as having less than it has by this share of the reserve: just beside it the map may
say less. It never counts as touching where it does not."""
ROUNDING_M = 1e-6


class FlightLimits(NamedTuple):
    """Limits of one vehicle's plans; the reserve is already taken off."""

    cruise_m_s: float
    """No plan is faster."""
    avoidance_m_s: float
    """No plan is faster with less clearance than `avoidance_distance_m`."""
    avoidance_distance_m: float
    avoidance_reserve_m: float
    """So much of that is more than the mission asks for."""
    nominal_ratio: float
    """Speed that is aimed at, as a share of the speeds above."""
    acceleration_m_s2: float
    braking_m_s2: float
    """Along the path, when speeds are laid out."""
    jerk_m_s3: float
    climb_tangent: float
    turn_radius_m: float
    clearance_m: float
    """No plan comes nearer to anything ..."""
    contact_m: float
    """... or, in launch zones, nearer than this: there nothing more is required than not to touch ..."""
    reserve_m: float
    """... and so much more is kept where that is possible: for tracking errors and what the map does not resolve."""
    clearance_cap_m: float
    """More clearance than this earns nothing."""
    height_m: float
    corridor_m: float
    """Half width of the corridor around the track."""


class Surroundings(NamedTuple):
    """Where a vehicle may be, as far as it is known and seen."""

    obstacles: Obstacles
    room_m: Array
    """(2, 3) lowest and highest corner of the flight range, ENU."""
    zones_m: Array
    """(z, 4) centre and radius of launch zones: around the start of the mission and its target."""
    field: Field
    """What was seen."""
    moving: Traffic
    """Movers and neighbours, from the beginning of the plan on."""


EAST, NORTH, UP, END_CLEARANCE, END_HEIGHT, END_OUTSIDE = range(6)
"""Columns of the ends of a plan: near them no more is required than what they have [m]."""


def flight_limits(mission: Mission, reserve: Reserve) -> FlightLimits:
    """The limits that plans of this mission keep, when they use no more of them than `reserve` leaves."""
    limits, least_m = mission.limits, reserve.gnss_margin_m if mission.site is Site.OUTDOOR else 0.0
    cap_m, clearance_m = mission.planner.clearance_cap_m, max(limits.clearance_m, limits.body_radius_m)
    avoidance_m = limits.avoidance_distance_m
    avoidance_reserve_m = max(reserve.distance_share * avoidance_m, least_m)
    return FlightLimits(
        cruise_m_s=limits.cruise_speed_m_s * reserve.limit_share,
        avoidance_m_s=limits.avoidance_speed_m_s * reserve.limit_share,
        avoidance_distance_m=avoidance_m + avoidance_reserve_m,
        avoidance_reserve_m=avoidance_reserve_m,
        nominal_ratio=reserve.nominal_share / reserve.limit_share,
        acceleration_m_s2=limits.acceleration_m_s2,
        braking_m_s2=limits.acceleration_m_s2 * reserve.braking_share,
        jerk_m_s3=limits.acceleration_m_s2 * reserve.jerk_per_acceleration_hz,
        climb_tangent=float(np.tan(np.radians(min(limits.climb_angle_deg, 89.0)))),
        turn_radius_m=limits.turn_radius_m,
        clearance_m=clearance_m,
        contact_m=limits.body_radius_m,
        reserve_m=max(reserve.distance_share * clearance_m, least_m),
        clearance_cap_m=cap_m if cap_m is not None else 2.0 * max(avoidance_m, limits.clearance_m),
        height_m=limits.height_m,
        corridor_m=reserve.corridor_share * mission.onboard.horizon_m,
    )


def surroundings(mission: Mission, obstacles: Obstacles, zones_m: Array) -> Surroundings:
    """What is known of the world around one vehicle.

    Args:
        mission: its flight range and launch zones' radius.
        obstacles: everything known.
        zones_m: (z, 3) centres of launch zones, ENU [m].
    """
    bounds = mission.world.bounds
    room_m = np.array([bounds.low_enu_m, bounds.high_enu_m], dtype=float)
    centres_m = np.asarray(zones_m, dtype=float).reshape(-1, 3)
    radius_m = np.full((len(centres_m), 1), mission.launch_zone_radius_m)
    return Surroundings(obstacles, room_m, np.hstack((centres_m, radius_m)), no_field(), no_traffic())


@compiled
def ends_of(start_m: Array, goal_m: Array, around: Surroundings, limits: FlightLimits) -> Array:
    """(2, 6) the start and the goal of a plan, each (3,) ENU [m], and what they have of all that is required.

    A start may be anywhere; a goal counts as having at least what it takes not to touch anything, and the reserve: who
    flies on to a goal beside which something is only seen on the way brakes before it touches that.
    """
    ends = np.empty((2, 6))
    for axis in range(3):
        ends[0, axis], ends[1, axis] = start_m[axis], goal_m[axis]
    for i in range(2):
        east, north, up = ends[i, 0], ends[i, 1], ends[i, 2]
        free_m = free_at(east, north, up, around)
        ends[i, END_CLEARANCE] = max(
            free_m - EASED_SHARE * limits.reserve_m, min(free_m, limits.contact_m) - ROUNDING_M
        )
        if i == 0:
            ends[i, END_CLEARANCE] = min(ends[i, END_CLEARANCE], mover_clearance(east, north, up, 0.0, around.moving))
        ends[i, END_HEIGHT] = up - terrain_height_at(east, north, around.obstacles) - ROUNDING_M
        ends[i, END_OUTSIDE] = outside(ends, i, around.room_m) + ROUNDING_M
    ends[1, END_CLEARANCE] = max(ends[1, END_CLEARANCE], limits.contact_m + limits.reserve_m)
    ends[1, END_HEIGHT] = max(ends[1, END_HEIGHT], 0.0)
    return ends


@compiled
def lacking(
    points_m: Array,
    free_m: Array,
    step_s: float,
    around: Surroundings,
    ends: Array,
    limits: FlightLimits,
    out: Array,
    scarce_m: Array,
) -> None:
    """How much each point lacks of the clearance, height, flight range and separation that are required of it.

    What is required is eased near the ends: who stands too near to a wall may leave along it, instead of freezing.
    Nobody is eased into touching something, or out of the flight range.

    Args:
        points_m: (m, 3 or more) ENU [m]; further columns are not read.
        free_m: (m,) clearance of each point.
        step_s: time from one point to the next, for what moves.
        around: terrain, flight range and launch zones.
        ends: (2, 6) of the plan.
        limits: what is required.
        out: (m,) is filled with metres; 0 where all is kept.
        scarce_m: (m,) is filled with what lacks of the clearance and the reserve [m].
    """
    obstacles, zones_m, room_m, eased = around.obstacles, around.zones_m, around.room_m, is_eased(ends, limits)
    moving = around.moving
    crowded = len(moving.bodies) > 0
    for i in range(len(points_m)):
        east, north, up = points_m[i, 0], points_m[i, 1], points_m[i, 2]
        clearance_m, height_m, allowed_m, in_zone = limits.clearance_m, limits.height_m, 0.0, False
        for z in range(len(zones_m)):
            if is_within(east - zones_m[z, 0], north - zones_m[z, 1], up - zones_m[z, 2], zones_m[z, 3]):
                clearance_m, height_m, in_zone = limits.contact_m, 0.0, True
        if eased:
            for e in range(2):
                eased_m = EASING * span(east - ends[e, EAST], north - ends[e, NORTH], up - ends[e, UP])
                clearance_m = min(clearance_m, ends[e, END_CLEARANCE] + eased_m)
                height_m = min(height_m, ends[e, END_HEIGHT] + eased_m)
                if e == 0:
                    allowed_m = max(ends[e, END_OUTSIDE] - eased_m, 0.0)
        ground_m = terrain_height_at(east, north, obstacles) if len(obstacles.peaks) > 0 else 0.0
        scarce_m[i] = max(clearance_m + limits.reserve_m - free_m[i], 0.0)
        out[i] = max(clearance_m - free_m[i], 0.0) + max(height_m - (up - ground_m), 0.0)
        out[i] += max(outside(points_m, i, room_m) - allowed_m, 0.0)
        if crowded:
            out[i] += crowding(east, north, up, i * step_s, in_zone, moving)


@compiled
def is_eased(ends: Array, limits: FlightLimits) -> bool:
    """An end, of (2, 6) `ends`, has less than what is required in general."""
    lacks, wanted_m = False, limits.clearance_m + limits.reserve_m
    for e in range(2):
        lacks = lacks or ends[e, END_CLEARANCE] < wanted_m or ends[e, END_HEIGHT] < limits.height_m
        lacks = lacks or ends[e, END_OUTSIDE] > ROUNDING_M
    return lacks


@compiled
def free_at(east: float, north: float, up: float, around: Surroundings) -> float:
    """Distance [m] from a place to what stands, whether it is known or was seen."""
    return min(clearance_at(east, north, up, around.obstacles), distance_at(east, north, up, around.field))


@compiled
def fill_standing(points_m: Array, around: Surroundings, out: Array) -> None:
    """Fill `out` (m,) with the distances of (m, 3 or more) points to what stands [m]."""
    fill_clearance(points_m, around.obstacles, out)
    lower_to_field(points_m, around.field, out)


@compiled
def free_space(points_m: Array, step_s: float, around: Surroundings, out: Array) -> None:
    """Fill `out` (m,) with the clearance of (m, 3 or more) points, `step_s` apart in time [m]."""
    fill_standing(points_m, around, out)
    if len(around.moving.bodies) > 0:
        for i in range(len(points_m)):
            east, north, up = points_m[i, 0], points_m[i, 1], points_m[i, 2]
            out[i] = min(out[i], mover_clearance(east, north, up, i * step_s, around.moving))


@compiled
def outside(points_m: Array, i: int, room_m: Array) -> float:
    """How far the i-th of (n, 3 or more) points is outside of the flight range (2, 3) [m]; 0 within."""
    beyond_m = 0.0
    for axis in range(3):
        beyond_m = max(beyond_m, max(room_m[0, axis] - points_m[i, axis], points_m[i, axis] - room_m[1, axis]))
    return beyond_m


@compiled
def is_within(x: float, y: float, z: float, radius: float) -> bool:
    """A vector is shorter than a radius."""
    return x * x + y * y + z * z < radius * radius


@compiled
def speed_limit(clearance_m: float, limits: FlightLimits) -> float:
    """The mission's speed rule: cruise in the open, slow with less clearance than the avoidance distance."""
    return limits.avoidance_m_s if clearance_m < limits.avoidance_distance_m else limits.cruise_m_s


@compiled
def span(x: float, y: float, z: float) -> float:
    """Length of a vector."""
    return np.sqrt(x * x + y * y + z * z)
