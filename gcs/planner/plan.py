"""What the cloud planner returns: one curve and one track per vehicle, and everything that is wrong with them."""

import json
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
import numpy.typing as npt

from missions.mission import Target
from missions.mission_items import MissionItem, Track

Array = npt.NDArray[np.float64]

JSON_DECIMALS = 6
"""Micrometres: turn radii can still be computed from the written samples."""


class Limit(Enum):
    """What a plan has to keep: its name, its unit, and whether it is a least or a greatest value."""

    CLEARANCE = ("clearance", "m", "at least")
    HEIGHT = ("height above the terrain", "m", "at least")
    BOUNDS = ("way outside of the flight range", "m", "at most")
    TURN_RADIUS = ("turn radius", "m", "at least")
    CLIMB_ANGLE = ("climb angle", "deg", "at most")
    RANGE = ("path length", "m", "at most")
    ENDURANCE = ("flight time", "s", "at most")
    SEPARATION = ("separation", "m", "at least")
    LEAST_MEAN_SEPARATION = ("mean separation", "m", "at least")
    GREATEST_MEAN_SEPARATION = ("mean separation", "m", "at most")
    START = ("distance of the beginning from the launch point", "m", "at most")
    TARGET = ("distance of the end from the target", "m", "at most")
    ROUTE = ("distance from a target on the way", "m", "at most")

    @property
    def title(self) -> str:
        return self.value[0]

    @property
    def unit(self) -> str:
        return self.value[1]

    @property
    def sense(self) -> str:
        return self.value[2]


@dataclass(frozen=True)
class Violation:
    """The worst breach of one limit by one vehicle.

    Args:
        vehicle: its name.
        limit: what is not kept.
        where: place, time and other vehicle, as far as they matter, in words; may be empty.
        found: in the unit of the limit.
        required: likewise.
    """

    vehicle: str
    limit: Limit
    where: str
    found: float
    required: float

    def __str__(self) -> str:
        limit, where = self.limit, f" {self.where}" if self.where else ""
        return (
            f"{self.vehicle}: {limit.title} {_number(self.found)} {limit.unit}{where}, "
            f"required is {limit.sense} {_number(self.required)} {limit.unit}"
        )


@dataclass(frozen=True)
class Progress:
    """How far planning has come.

    Args:
        iteration: number of swarm iterations so far.
        evaluations: of whole plans so far; one vehicle's curve counts as the fleet's share of one.
        objective: what the best plan so far costs the search: eq. 13 as it samples it, plus what slow flight near
            obstacles costs in time, and while no plan is feasible, plus a penalty for violations. From one feasible
            plan to the next it falls.
        feasible: whether the best plan so far keeps all limits.
        share_done: of the budget, 0 to 1.
    """

    iteration: int
    evaluations: int
    objective: float
    feasible: bool
    share_done: float


@dataclass(frozen=True)
class TimedCurve:
    """Where one vehicle goes, and when: what the judge looks at.

    Args:
        name: of the vehicle.
        sysid: its MAVLink system id.
        targets: where it goes, in flying order.
        curve_m: (m, 3) ENU samples from the launch point to the last target, equally spaced along the curve; sample i
            of all vehicles is passed at the same time.
        times_s: (m,) seconds since the common start T0 at which they are passed.
    """

    name: str
    sysid: int
    targets: tuple[Target, ...]
    curve_m: Array
    times_s: Array

    @property
    def target(self) -> Target:
        """Where it arrives."""
        return self.targets[-1]

    @property
    def stops_m(self) -> Array:
        """(k, 3) the targets that it passes on the way."""
        return np.array([target.position_m for target in self.targets[:-1]], dtype=float).reshape(-1, 3)


@dataclass(frozen=True)
class GivenItems:
    """What another tool has planned, to be stored on the vehicle as it is: mission, fence and rally points."""

    items: tuple[MissionItem, ...]
    fence: tuple[MissionItem, ...] = ()
    rally: tuple[MissionItem, ...] = ()


@dataclass(frozen=True)
class VehiclePlan(TimedCurve):
    """One vehicle's part of a plan.

    Args:
        track: the points and speeds that autopilot and companion are given.
        length_m: of the curve.
        given: instead of items made from the track.
    """

    track: Track
    length_m: float
    given: GivenItems | None = None

    @property
    def targets_alone(self) -> Track:
        """The targets without the track points between them, for a companion that plans its way itself."""
        stops_m = np.array([target.position_m for target in self.targets])
        kept = [int(np.argmin(np.linalg.norm(self.track.points_m - stop_m, axis=1))) for stop_m in stops_m]
        return Track(self.track.points_m[kept], self.track.speeds_m_s[kept])


@dataclass(frozen=True)
class FleetPlan:
    """A plan for all vehicles of a mission.

    Args:
        mission: its name.
        algorithm: that found the plan.
        seed: of its random numbers.
        evaluations: of whole plans that it took.
        wall_s: time that it took.
        cpu_s: likewise, of this thread.
        objective: eq. 13, summed over all vehicles.
        feasible: whether the judge (`feasibility`) found no violation.
        violations: what it found.
        convergence: the progress after each iteration.
        vehicles: those that fly, in the order of the mission.
        staying: names of the vehicles that get no target and stay on their pads.
    """

    mission: str
    algorithm: str
    seed: int
    evaluations: int
    wall_s: float
    cpu_s: float
    objective: float
    feasible: bool
    violations: tuple[Violation, ...]
    convergence: tuple[Progress, ...]
    vehicles: tuple[VehiclePlan, ...]
    staying: tuple[str, ...] = ()

    def to_json(self) -> str:
        """The plan as `gcs plan --output x.json` writes it; `convergence` is the best objective of each iteration."""
        head = ("mission", "algorithm", "seed", "evaluations", "wall_s", "cpu_s", "objective", "feasible")
        document: dict[str, Any] = {name: getattr(self, name) for name in head}
        document["violations"] = [_violation_as_json(violation) for violation in self.violations]
        document["convergence"] = [progress.objective for progress in self.convergence]
        document["vehicles"] = [_vehicle_as_json(vehicle) for vehicle in self.vehicles]
        document["staying"] = list(self.staying)
        return json.dumps(document)


def _number(value: float) -> str:
    return f"{value:.3f}".rstrip("0").rstrip(".")


def _violation_as_json(violation: Violation) -> dict[str, Any]:
    return {
        "vehicle": violation.vehicle,
        "limit": violation.limit.name.lower(),
        "where": violation.where,
        "found": violation.found,
        "required": violation.required,
        "text": str(violation),
    }


def _vehicle_as_json(vehicle: VehiclePlan) -> dict[str, Any]:
    return {
        "name": vehicle.name,
        "target": vehicle.target.name,
        "targets": [target.name for target in vehicle.targets],
        "track_points_enu_m": vehicle.track.points_m.round(JSON_DECIMALS).tolist(),
        "curve_enu_m": vehicle.curve_m.round(JSON_DECIMALS).tolist(),
        "length_m": vehicle.length_m,
    }
