"""A mission as the search sees it: arrays for the compiled costs, its limits tightened by a margin."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gcs.planner import limits
from gcs.planner.coupling import Coupling
from gcs.planner.curve_cost import Terms, sampling
from gcs.planner.fleet_cost import Problem
from gcs.planner.joining import Joining
from gcs.planner.representation import Guide, guide_along, pin_weights, straight_legs
from missions import obstacles, time_law
from missions.mission import Mission, Target

Array = npt.NDArray[np.float64]

CRUISE_MARGIN = 1.1
"""With this many times the avoidance distance of clearance, a vehicle surely flies at cruise speed."""
PENALTY = 0.3
"""A violation of one costs as much as this share of the fleet's mean straight flight."""
MEAN_UNIT_SHARE = 0.1
"""A mean separation that is off by this share of its upper bound, or of the mission's size, is a violation of one."""

MOST_SAMPLES = 512
MOST_CONTROL_POINTS = 24
"""Of curves that follow a guide path, for each leg of a route."""

POINTS_PER_STOP = 6
"""Control points that a target on the way adds; with four, climbs from target to target often have no room to wind."""

FRACTIONS = 48
"""Fractions of the paths at which vehicles are compared."""


@dataclass(frozen=True)
class Way:
    """A polygon from a start through all targets of one vehicle.

    Args:
        corners_m: (m, 3) ENU.
        stops: indices of the corners that are targets on the way.
    """

    corners_m: Array
    stops: tuple[int, ...] = ()


@dataclass(frozen=True)
class Route:
    """Where one vehicle goes."""

    name: str
    sysid: int
    start_m: Array
    """(3,) ENU."""
    targets: tuple[Target, ...]
    """In flying order, one at least."""

    @property
    def places_m(self) -> Array:
        """(1 + k, 3) start and targets."""
        return np.concatenate((self.start_m[None], [target.position_m for target in self.targets]))

    @property
    def straight(self) -> Way:
        """From place to place without a bend."""
        return Way(self.places_m, tuple(range(1, len(self.targets))))

    @property
    def direct_m(self) -> float:
        """Length of the straight way."""
        return float(time_law.arc_length(self.places_m)[-1])


@dataclass(frozen=True)
class Care:
    """How closely the search looks, and how far it stays away from the limits for what it does not see.

    Args:
        samples: of each curve.
        distance_share: by which clearance, height, bounds and separation are kept better than required.
        share: likewise for means, angles and lengths.
        turn_share: likewise for the turn radius.
    """

    samples: int = 64
    distance_share: float = 0.02
    share: float = 0.002
    turn_share: float = 0.02

    def raised(self) -> "Care":
        """For a plan that the judge refused: twice as close, up to a limit, and twice as far away."""
        return Care(
            min(2 * self.samples, MOST_SAMPLES), 2.0 * self.distance_share, 2.0 * self.share, 2.0 * self.turn_share
        )


def guides_along(mission: Mission, ways: Sequence[Way], n_control: int) -> list[Guide]:
    """What offsets are counted from, for curves with so many control points."""
    return [guide_along(way.corners_m, n_control, mission.world.bounds, way.stops) for way in ways]


def guides(mission: Mission, routes: Sequence[Route]) -> list[Guide]:
    """Guides that lead straight from target to target."""
    ways = [route.straight for route in routes]
    n_control = control_points(mission, ways)
    if any(way.stops for way in ways):
        return guides_along(mission, ways, n_control)
    begins_m, ends_m = np.array([way.corners_m for way in ways]).transpose(1, 0, 2)
    bases_m, axes_m = straight_legs(begins_m, ends_m, n_control, mission.world.bounds)
    return [Guide(*each, pins=np.zeros(0, np.int64)) for each in zip(bases_m, axes_m, strict=True)]


def control_points(mission: Mission, ways: Sequence[Way], per_corner: int = 0) -> int:
    """Control points of curves along such ways: as the mission says, more for many targets or to follow corners."""
    most_stops = max(len(way.stops) for way in ways)
    enough = mission.planner.control_points + POINTS_PER_STOP * most_stops
    corners = max(len(way.corners_m) for way in ways)
    return max(enough, min(per_corner * corners, MOST_CONTROL_POINTS * (1 + most_stops)))


def pose(mission: Mission, routes: Sequence[Route], guides: Sequence[Guide], care: Care = Care()) -> Problem:
    """The arrays that the compiled costs read."""
    n_control = len(guides[0].base_m)
    most_pins = max(len(guide.pins) for guide in guides)
    pins, zones_m = np.zeros((len(routes), most_pins), np.int64), np.empty((len(routes), most_pins + 2, 3))
    for index, (route, guide) in enumerate(zip(routes, guides, strict=True)):
        pins[index, : len(guide.pins)] = guide.pins
        places_m = route.places_m
        zones_m[index, : len(places_m)], zones_m[index, len(places_m) :] = places_m, places_m[-1]
    return Problem(
        base_m=np.array([guide.base_m for guide in guides]),
        axes_m=np.array([guide.axes_m for guide in guides]),
        pins=pins,
        pin_weights=pin_weights(n_control),
        zones_m=zones_m,
        samples=sampling(n_control, care.samples * -(-n_control // MOST_CONTROL_POINTS)),
        terms=_terms(mission, routes, care),
        coupling=_coupling(mission, routes, care),
        joining=_joining(mission, routes, care),
        obstacles=obstacles.pack(mission.world.as_known()),
    )


def _terms(mission: Mission, routes: Sequence[Route], care: Care) -> Terms:
    kept, weights = mission.limits, mission.planner
    straight_cost = weights.length_weight * _mean_direct_m(routes)
    unit_m = max(kept.clearance_m, kept.body_radius_m)
    margin_m = care.distance_share * unit_m
    low_m, high_m = _inside(limits.flight_box(mission), margin_m, routes)
    clearance_cap_m = limits.clearance_cap_m(mission, mission.world.as_known())
    clearance_m = kept.clearance_m + margin_m
    cruise_m = CRUISE_MARGIN * kept.avoidance_distance_m
    return Terms(
        length_weight=weights.length_weight,
        clearance_weight=weights.clearance_weight,
        height_weight=weights.height_weight,
        clearance_cap_m=clearance_cap_m,
        height_cap_m=limits.height_cap_m(mission),
        look_m=max(clearance_cap_m, clearance_m, kept.body_radius_m, cruise_m),
        slow_cost=straight_cost * (kept.cruise_speed_m_s / kept.avoidance_speed_m_s - 1.0),
        slow_m=kept.avoidance_distance_m,
        cruise_m=cruise_m,
        penalty_weight=PENALTY * straight_cost,
        clearance_m=clearance_m,
        contact_m=kept.body_radius_m + margin_m,
        height_m=kept.height_m + margin_m,
        zone_radius_m=mission.launch_zone_radius_m,
        turn_radius_m=kept.turn_radius_m * (1.0 + care.turn_share),
        climb_sine=float(np.sin(np.radians(kept.climb_angle_deg))) * (1.0 - care.share),
        length_m=limits.path_limit_m(mission) * (1.0 - care.share),
        unit_m=unit_m,
        low_m=(float(low_m[0]), float(low_m[1]), float(low_m[2])),
        high_m=(float(high_m[0]), float(high_m[1]), float(high_m[2])),
    )


def _coupling(mission: Mission, routes: Sequence[Route], care: Care) -> Coupling:
    kept = mission.limits
    mean_low_m, mean_high_m = kept.mean_separation_m
    longest_m = max(route.direct_m for route in routes)
    first, last = _windows(mission, longest_m)
    missed_m = 0.5 * longest_m / (FRACTIONS - 1) if mission.planner.time_slack_s > 0.0 else 0.0
    return Coupling(
        separation_m=float(np.hypot(kept.separation_m, missed_m)) * (1.0 + care.distance_share),
        zone_radius_m=mission.launch_zone_radius_m,
        contact_m=2.0 * kept.body_radius_m * (1.0 + care.distance_share),
        join_m=limits.join_distance_m(mission),
        mean_low_m=mean_low_m * (1.0 + care.share),
        mean_high_m=mean_high_m * (1.0 - care.share),
        mean_unit_m=MEAN_UNIT_SHARE * min(mean_high_m, _mean_direct_m(routes)),
        first=first,
        last=last,
    )


def _joining(mission: Mission, routes: Sequence[Route], care: Care) -> Joining:
    pads_m = [mission.vehicle(route.sysid).pad_m for route in routes if mission.launch_point_m is not None]
    return Joining(
        hovers_m=np.array(pads_m, dtype=float).reshape(-1, 3) + np.array([0.0, 0.0, mission.takeoff_height_m]),
        distance_m=limits.join_distance_m(mission),
        contact_m=2.0 * mission.limits.body_radius_m * (1.0 + care.distance_share),
    )


def _mean_direct_m(routes: Sequence[Route]) -> float:
    return max(float(np.mean([route.direct_m for route in routes])), 1e-3)


def _inside(box_m: tuple[Array, Array], margin_m: float, routes: Sequence[Route]) -> tuple[Array, Array]:
    """The box drawn in by a margin, but not past any start or target."""
    ends = np.concatenate([route.places_m for route in routes])
    return np.minimum(box_m[0] + margin_m, ends.min(axis=0)), np.maximum(box_m[1] - margin_m, ends.max(axis=0))


def _windows(mission: Mission, longest_m: float) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """(k,) first and last fraction at which a vehicle may be that is up to the time slack early or late.

    Taken from the fastest flight: whoever is slower gets less far out of step.
    """
    kept = mission.limits
    along = np.zeros((FRACTIONS, 3))
    along[:, 0] = np.linspace(0.0, longest_m, FRACTIONS)
    cruise_m_s = np.full(FRACTIONS, kept.cruise_speed_m_s)
    times_s = time_law.times_along(along, time_law.speeds_along(along, cruise_m_s, kept.acceleration_m_s2))
    slack_s = mission.planner.time_slack_s + 1e-9
    first, last = np.searchsorted(times_s, times_s - slack_s), np.searchsorted(times_s, times_s + slack_s, "right") - 1
    return first.astype(np.int64), last.astype(np.int64)
