"""The judge: does a plan keep every limit of its mission? Plain numpy over dense samples, apart from the search.

A plan is called feasible only by this module. It looks at the curves that the plan hands out, at every sample: at most
`SPACING_M` apart, so that nothing hides between two of them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gcs.planner.curves import curvature, lengths, passing_samples, path_lengths
from gcs.planner.limits import flight_box, join_distance_m
from gcs.planner.plan import Limit, TimedCurve, Violation
from missions import obstacles
from missions.mission import Mission, Site

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

SPACING_M = {Site.INDOOR: 0.05, Site.OUTDOOR: 1.0}
"""Samples of a curve that is to be judged lie at most so far apart."""
MEAN_STRIDE = 4
"""Means are taken over every so-manyth sample: distances between vehicles change slowly."""
JOINING_SAMPLES = 200
"""Of the ways from pads to curves: tens of metres, looked at every few decimetres."""
COARSE_STRIDE = 16
"""Every so-manyth sample tells which vehicles never come near one another."""
ROUNDING = 1e-9
"""Tolerance, for the rounding of floating-point sums alone."""


@dataclass(frozen=True)
class _Fleet:
    """All vehicles at m common times, and where along their curves the launch zones matter.

    Args:
        places_m: (vehicles, m, 3) ENU.
        times_s: (m,) since T0.
        steps_m: (vehicles, m - 1) from sample to sample.
        near_start: (vehicles, m) in the zone around the launch point: separation rests there, contact does not ...
        joined: (vehicles, m) ... once a vehicle has joined its curve from its pad.
        near_target: (vehicles, m) in the zone around a target: clearance and height rest in all zones.
    """

    places_m: Array
    times_s: Array
    steps_m: Array
    near_start: BoolArray
    joined: BoolArray
    near_target: BoolArray


@dataclass(frozen=True)
class Measured:
    """What the judge measures at every sample of every curve; times and objective follow from the same numbers.

    Args:
        clearance_m: (vehicles, m) in the world as it is known.
        height_m: (vehicles, m) above the terrain.
        curvature_1_m: (vehicles, m).
    """

    clearance_m: Array
    height_m: Array
    curvature_1_m: Array


def measure(mission: Mission, curves_m: Array) -> Measured:
    """Measure (vehicles, m, 3) curves, ENU [m]."""
    solid = obstacles.pack(mission.world.as_known())
    return Measured(
        clearance_m=obstacles.clearance(curves_m, solid).reshape(curves_m.shape[:2]),
        height_m=curves_m[..., 2] - obstacles.terrain_height(curves_m, solid),
        curvature_1_m=curvature(curves_m),
    )


def violations(
    mission: Mission, vehicles: Sequence[TimedCurve], measured: Measured | None = None
) -> tuple[Violation, ...]:
    """Everything that is wrong with a plan: the worst breach of each limit by each vehicle or pair of vehicles.

    Args:
        mission: its limits and its world as it is known.
        vehicles: the plan.
        measured: what `measure` finds on these curves, where that is known already.

    Raises:
        ValueError: samples are too far apart to be judged, or not those of common times.
    """
    fleet = _assemble(mission, vehicles)
    measured = measured or measure(mission, fleet.places_m)
    found: list[Violation] = []
    for index, vehicle in enumerate(vehicles):
        found += _ends(mission, vehicle)
        found += _passed(mission, vehicle)
        in_zone = fleet.near_start[index] | fleet.near_target[index]
        found += _near_things(mission, vehicle, in_zone, measured.clearance_m[index], measured.height_m[index])
        found += _outside(mission, vehicle)
        found += _shape(mission, vehicle, measured.curvature_1_m[index])
        found += _reach(mission, vehicle)
    if len(vehicles) > 1:
        found += _joining(mission, vehicles, fleet)
        found += _mean_separations(mission, vehicles, fleet)
        found += _separations(mission, vehicles, fleet)
    return tuple(found)


def _assemble(mission: Mission, vehicles: Sequence[TimedCurve]) -> _Fleet:
    times_s, spacing_m = vehicles[0].times_s, SPACING_M[mission.site]
    for vehicle in vehicles:
        if not np.array_equal(vehicle.times_s, times_s):
            raise ValueError(f"the samples of {vehicle.name}'s curve are not at the times of {vehicles[0].name}'s")
    places_m = np.array([vehicle.curve_m for vehicle in vehicles])
    steps_m = lengths(np.diff(places_m, axis=1))
    for vehicle, apart_m in zip(vehicles, steps_m.max(axis=1).tolist(), strict=True):
        if apart_m > spacing_m:
            raise ValueError(
                f"samples of {vehicle.name}'s curve: {apart_m:.3g} m apart, expected at most {spacing_m:g} m"
            )
    flown_m = lengths(places_m - places_m[:, :1])
    to_target_m = np.array([_to_targets(vehicle) for vehicle in vehicles])
    radius_m = mission.launch_zone_radius_m
    joined = flown_m > join_distance_m(mission)
    return _Fleet(places_m, times_s, steps_m, flown_m < radius_m, joined, to_target_m < radius_m)


def _to_targets(vehicle: TimedCurve) -> Array:
    """(m,) distance of every sample to the nearest of the vehicle's targets."""
    return np.min([lengths(vehicle.curve_m - np.array(target.position_m)) for target in vehicle.targets], axis=0)


def _ends(mission: Mission, vehicle: TimedCurve) -> Iterator[Violation]:
    ends = (
        (Limit.START, vehicle.curve_m[0], mission.start_m(mission.vehicle(vehicle.sysid))),
        (Limit.TARGET, vehicle.curve_m[-1], np.array(vehicle.target.position_m)),
    )
    for limit, found_m, wanted_m in ends:
        off_m = float(np.linalg.norm(found_m - wanted_m))
        if off_m > ROUNDING:
            yield Violation(vehicle.name, limit, "", off_m, 0.0)


def _passed(mission: Mission, vehicle: TimedCurve) -> Iterator[Violation]:
    """The targets on the way are passed in their order, as near as the distance of two samples."""
    stops_m = vehicle.stops_m
    near_m = SPACING_M[mission.site]
    for target, stop_m, index in zip(vehicle.targets, stops_m, passing_samples(vehicle.curve_m, stops_m), strict=False):
        off_m = float(np.linalg.norm(vehicle.curve_m[index] - stop_m))
        if off_m > near_m:
            where = f"({target.name}) {_at(vehicle.curve_m[index], float(vehicle.times_s[index]))}"
            yield Violation(vehicle.name, Limit.ROUTE, where, off_m, near_m)


def _near_things(
    mission: Mission, vehicle: TimedCurve, in_zone: BoolArray, clearance_m: Array, height_m: Array
) -> Iterator[Violation]:
    limits = mission.limits
    yield from _least(
        vehicle, Limit.CLEARANCE, clearance_m, np.where(in_zone, limits.body_radius_m, limits.clearance_m)
    )
    yield from _least(vehicle, Limit.HEIGHT, height_m, np.where(in_zone, 0.0, limits.height_m))


def _outside(mission: Mission, vehicle: TimedCurve) -> Iterator[Violation]:
    low_m, high_m = flight_box(mission)
    east_m, north_m, up_m = np.maximum(low_m - vehicle.curve_m, vehicle.curve_m - high_m).T
    out_m = np.maximum(np.maximum(east_m, north_m), up_m)
    yield from _most(vehicle, Limit.BOUNDS, out_m, 0.0)


def _shape(mission: Mission, vehicle: TimedCurve, curvature_1_m: Array) -> Iterator[Violation]:
    limits = mission.limits
    radius_m = 1.0 / np.maximum(curvature_1_m, 1e-12)
    yield from _least(vehicle, Limit.TURN_RADIUS, radius_m, np.full(len(radius_m), limits.turn_radius_m))
    east_m, north_m, up_m = np.ascontiguousarray(np.diff(vehicle.curve_m, axis=0).T)
    level_m = np.sqrt(east_m * east_m + north_m * north_m)
    moving = np.maximum(level_m, np.abs(up_m)) > ROUNDING
    steepness = np.where(moving, np.abs(up_m) / np.maximum(level_m, ROUNDING), 0.0)
    climb_deg = np.zeros(len(up_m))
    worst = int(np.argmax(steepness))
    climb_deg[worst] = np.degrees(np.arctan(steepness[worst]))
    yield from _most(vehicle, Limit.CLIMB_ANGLE, climb_deg, limits.climb_angle_deg)


def _reach(mission: Mission, vehicle: TimedCurve) -> Iterator[Violation]:
    length_m = float(path_lengths(vehicle.curve_m))
    if length_m > mission.limits.range_m:
        yield Violation(vehicle.name, Limit.RANGE, "", length_m, mission.limits.range_m)
    if vehicle.times_s[-1] > mission.limits.endurance_s:
        yield Violation(vehicle.name, Limit.ENDURANCE, "", float(vehicle.times_s[-1]), mission.limits.endurance_s)


def _joining(mission: Mission, vehicles: Sequence[TimedCurve], fleet: _Fleet) -> Iterator[Violation]:
    """No contact on the way from where vehicles hover above their pads to curves that begin in one launch point.

    All set out at T0 and fly straight to where they are to have joined their curves, at equal shares of the way.
    """
    if mission.launch_point_m is None:
        return
    distance_m = join_distance_m(mission)
    places_m = np.array(
        [_way_to_curve(mission, *each, distance_m) for each in zip(vehicles, fleet.joined, strict=True)]
    )
    contact_m = 2.0 * mission.limits.body_radius_m
    for i, vehicle in enumerate(vehicles):
        nearest_m = lengths(places_m[i + 1 :] - places_m[i]).min(axis=1)
        for j in np.flatnonzero(nearest_m < contact_m - ROUNDING).tolist():
            where = f"on the way from its pad to its curve, to {vehicles[i + 1 + j].name}"
            yield Violation(vehicle.name, Limit.SEPARATION, where, float(nearest_m[j]), contact_m)


def _way_to_curve(mission: Mission, vehicle: TimedCurve, joined: BoolArray, distance_m: float) -> Array:
    """(`JOINING_SAMPLES`, 3) places from the hover above the pad to where the curve is joined."""
    pad_m = np.array(mission.vehicle(vehicle.sysid).pad_m)
    hover_m = pad_m + np.array([0.0, 0.0, mission.takeoff_height_m])
    at_m = vehicle.curve_m[-1]
    if joined.any():
        before_m, behind_m = vehicle.curve_m[(first := int(np.argmax(joined))) - 1 : first + 1]
        away_m = lengths(np.stack((before_m, behind_m)) - vehicle.curve_m[0])
        share = (distance_m - away_m[0]) / (away_m[1] - away_m[0])
        at_m = before_m + share * (behind_m - before_m)
    return hover_m + np.linspace(0.0, 1.0, JOINING_SAMPLES)[:, None] * (at_m - hover_m)


def _mean_separations(mission: Mission, vehicles: Sequence[TimedCurve], fleet: _Fleet) -> Iterator[Violation]:
    """The mean over the flight, at equal fractions of the paths, of each vehicle's mean distance to the others."""
    low_m, high_m = mission.limits.mean_separation_m
    last = len(fleet.times_s) - 1
    looked_at = np.unique(np.append(np.arange(0, last, MEAN_STRIDE), last))
    places_m, n = fleet.places_m[:, looked_at], len(vehicles)
    apart_m = np.zeros((n, n))
    for i in range(n - 1):
        flown = lengths(places_m[i + 1 :] - places_m[i])
        apart_m[i, i + 1 :] = apart_m[i + 1 :, i] = np.trapezoid(flown, looked_at / last)
    for vehicle, mean_m in zip(vehicles, (apart_m.sum(axis=1) / (n - 1)).tolist(), strict=True):
        if mean_m < low_m:
            yield Violation(vehicle.name, Limit.LEAST_MEAN_SEPARATION, "", mean_m, low_m)
        if mean_m > high_m:
            yield Violation(vehicle.name, Limit.GREATEST_MEAN_SEPARATION, "", mean_m, high_m)


def _separations(mission: Mission, vehicles: Sequence[TimedCurve], fleet: _Fleet) -> Iterator[Violation]:
    """The separation of every two vehicles at all pairs of times that lie no more than the time slack apart."""
    ahead = _samples_ahead(mission, fleet)
    near = _may_meet(mission, fleet, ahead)
    for i, others in enumerate(near):
        short_m, at, shift = _closest(mission, fleet, i, others, ahead)
        for j, missing_m, k, later in zip(others.tolist(), short_m.tolist(), at.tolist(), shift.tolist(), strict=True):
            seen = j < i and later == 0  # at the same time: reported with j
            if seen or missing_m <= ROUNDING:
                continue
            place, time_s = fleet.places_m[i, k], float(fleet.times_s[k])
            found_m = float(np.linalg.norm(place - fleet.places_m[j, k + later]))
            later_s = fleet.times_s[k + later] - time_s
            where = f"{_at(place, time_s)}, to {vehicles[int(j)].name}" + (
                f" {later_s:.1f} s later" if later_s > 0.0 else ""
            )
            yield Violation(vehicles[i].name, Limit.SEPARATION, where, found_m, found_m + missing_m)


def _samples_ahead(mission: Mission, fleet: _Fleet) -> int:
    """How many samples the other vehicle may be ahead at most, the time slack considered, plus one."""
    times_s, m = fleet.times_s, len(fleet.times_s)
    slack_s = mission.planner.time_slack_s + ROUNDING
    return min(int((np.searchsorted(times_s, times_s + slack_s, "right") - np.arange(m)).max()), m)


def _may_meet(mission: Mission, fleet: _Fleet, ahead: int) -> list[IntArray]:
    """For every vehicle the others that come near enough, by few samples, to be looked at in all.

    Where only equal times matter, each pair is looked at once.
    Between a sample and the nearest one that is looked at here lie at most half a stride; a vehicle cannot move farther
    than the samples between are apart.
    """
    places_m = fleet.places_m[:, ::COARSE_STRIDE]
    step_m = float(fleet.steps_m.max())
    reach_m = (
        max(mission.limits.separation_m, 2.0 * mission.limits.body_radius_m) + (2 * COARSE_STRIDE + ahead) * step_m
    )
    found: list[IntArray] = []
    for i, own_m in enumerate(places_m):
        begin = i + 1 if ahead == 1 else 0
        near = lengths(places_m[begin:] - own_m).min(axis=1) <= reach_m
        others = begin + np.flatnonzero(near)
        found.append(others[others != i])
    return found


def _closest(mission: Mission, fleet: _Fleet, i: int, others: IntArray, ahead: int) -> tuple[Array, IntArray, IntArray]:
    """Where vehicle i is nearest to each of some others that are as late as the time slack allows, or less.

    Returns:
        Three (others,): how much separation is missing [m], sample of vehicle i, samples that the other is ahead.
    """
    limits, times_s, m, n = mission.limits, fleet.times_s, len(fleet.times_s), len(others)
    places_m, joined, near_start = fleet.places_m[others], fleet.joined[others], fleet.near_start[others]
    worst_m, at, shift = np.full(n, -np.inf), np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
    for later in range(ahead if n else 0):
        now, then = slice(0, m - later), slice(later, m)
        both_joined = fleet.joined[i, now] & joined[:, then]
        resting = fleet.near_start[i, now] & near_start[:, then]
        required_m = np.where(resting, np.where(both_joined, 2.0 * limits.body_radius_m, 0.0), limits.separation_m)
        short_m = required_m - lengths(places_m[:, then] - fleet.places_m[i, now])
        short_m[:, times_s[then] - times_s[now] > mission.planner.time_slack_s + ROUNDING] = -np.inf
        where = np.argmax(short_m, axis=1)
        found_m = short_m[np.arange(n), where]
        better = found_m > worst_m
        worst_m[better], at[better], shift[better] = found_m[better], where[better], later
    return worst_m, at, shift


def _least(vehicle: TimedCurve, limit: Limit, found: Array, required: Array) -> Iterator[Violation]:
    worst = int(np.argmax(required - found))
    if required[worst] - found[worst] > ROUNDING:
        where = _at(vehicle.curve_m[worst], float(vehicle.times_s[worst]))
        yield Violation(vehicle.name, limit, where, float(found[worst]), float(required[worst]))


def _most(vehicle: TimedCurve, limit: Limit, found: Array, required: float) -> Iterator[Violation]:
    worst = int(np.argmax(found))
    if found[worst] - required > ROUNDING:
        where = _at(vehicle.curve_m[worst], float(vehicle.times_s[worst]))
        yield Violation(vehicle.name, limit, where, float(found[worst]), required)


def _at(place_m: Array, time_s: float) -> str:
    east_m, north_m, up_m = place_m
    return f"at ({east_m:.1f}, {north_m:.1f}, {up_m:.1f}) m, {time_s:.1f} s after T0"
