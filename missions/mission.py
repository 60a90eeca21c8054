"""Missions: a world, vehicles, targets and limits, read from YAML and checked once, here at the edge."""

import math
import zlib
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np

from missions import obstacles
from missions.errors import ConfigError, MissionError
from missions.faults import LinkConditions, SimulatorFault
from missions.frames import GeodeticPoint, LocalFrame
from missions.world import Name, NotNegative, Point3, Positive, World
from missions.yaml_source import load_struct

SHIPPED = Path(__file__).parent
"""The folder of the mission files that come with the project."""

SystemId = Annotated[int, msgspec.Meta(ge=1, le=250)]
Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
Degrees = Annotated[float, msgspec.Meta(gt=0.0, le=90.0)]


class Site(Enum):
    """Where a mission is flown; sets how exactly a vehicle must stand, and how wide the fence is."""

    INDOOR = "indoor"
    OUTDOOR = "outdoor"

    @property
    def start_tolerance_m(self) -> float:
        """How far from its pad a vehicle may stand before it is armed."""
        return 1.0 if self is Site.INDOOR else 5.0

    @property
    def arrival_tolerance_m(self) -> float:
        """How near to its target a vehicle has reached it."""
        return 0.5 if self is Site.INDOOR else 2.0

    @property
    def fence_margin_m(self) -> float:
        """How far beyond the flight range the geofence lies."""
        return 1.0 if self is Site.INDOOR else 5.0

    @property
    def pad_spacing_m(self) -> float:
        """The least distance between two pads."""
        return 1.5 if self is Site.INDOOR else 3.0


class OnArrival(Enum):
    """What a vehicle does at its target."""

    LAND = "land"
    HOLD = "hold"
    RTL = "rtl"


class Vehicle(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One vehicle: its MAVLink system id, and the pad on which it stands."""

    name: Name
    sysid: SystemId
    pad_m: Point3


class Target(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A point to be reached."""

    name: Name
    position_m: Point3


class Limits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What every plan and every flight keeps; the paper's symbols are named where there is one."""

    cruise_speed_m_s: Positive
    """Speed in the open (the paper's patrol speed)."""
    avoidance_speed_m_s: Positive
    """Speed while avoiding, which is: with less clearance than `avoidance_distance_m`."""
    avoidance_distance_m: NotNegative
    acceleration_m_s2: Positive = 2.0
    climb_angle_deg: Degrees = 45.0
    """Steepest climb or descent, theta."""
    turn_radius_m: NotNegative = 0.0
    """Least turn radius, R."""
    clearance_m: NotNegative
    """Least distance of a vehicle's centre to obstacles and threats, lambda_min."""
    height_m: NotNegative = 0.0
    """Least height above the terrain outside the launch zone, H_min."""
    separation_m: NotNegative
    """Least distance between two vehicles' centres at any time."""
    mean_separation_m: tuple[NotNegative, Positive] = (0.0, 1e6)
    """Bounds of a vehicle's mean distance to the others over the flight, rho_min and rho_max."""
    range_m: Positive
    """Longest path, L_max."""
    endurance_s: Positive
    body_radius_m: Positive = 0.2
    """A vehicle touches what is nearer to its centre than this."""

    def __post_init__(self) -> None:
        low, high = self.mean_separation_m
        if not low < high:
            raise ValueError(f"expected mean_separation_m as [low, high], found [{low:g}, {high:g}]")
        if self.avoidance_speed_m_s > self.cruise_speed_m_s:
            raise ValueError("expected avoidance_speed_m_s to be at most cruise_speed_m_s")


class PlannerSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the cloud planner weighs a plan (eq. 13) and how sure it has to be."""

    length_weight: NotNegative = 0.2
    clearance_weight: NotNegative = 0.3
    height_weight: NotNegative = 0.1
    clearance_cap_m: Positive | None = None
    """More clearance than this earns nothing (reading A50: 50 m); without it clearance is bought with length."""
    height_cap_m: Positive | None = None
    control_points: Annotated[int, msgspec.Meta(ge=6, le=24)] = 8
    """Control points of one vehicle's cubic B-spline, its two ends included."""
    time_slack_s: NotNegative = 0.0
    """Separation holds even when one vehicle is this much early or late."""


class OnboardSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How far and how finely the companions plan."""

    horizon_m: Annotated[float, msgspec.Meta(gt=0.0, le=250.0)] = 7.5
    """What a trajectory message reaches over ends the horizon."""
    voxel_m: Positive = 0.1


class SensorKind(Enum):
    """What a vehicle sees with."""

    LIDAR = "lidar"
    """Points in datagrams of their own."""
    OBSTACLE_DISTANCE = "obstacle-distance"
    """A ring of distances, by way of the autopilot."""
    NONE = "none"
    """Nothing: it flies by the mission's map alone."""


class RangeSensor(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The companion's range sensor: a lidar, or a depth camera looking forward."""

    range_m: Positive = 5.0
    horizontal_deg: Annotated[float, msgspec.Meta(gt=0.0, le=360.0)] = 360.0
    vertical_deg: Annotated[float, msgspec.Meta(gt=0.0, le=180.0)] = 70.0
    rate_hz: Positive = 10.0
    noise_m: NotNegative = 0.02
    dropout: Share = 0.02
    spacing_deg: Annotated[float, msgspec.Meta(ge=0.2, le=30.0)] = 3.0
    """Between neighbouring rays of one scan, as the simulator casts them."""


class Positioning(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Errors of the autopilots' estimates: vision-grade by default, set wider for GNSS."""

    horizontal_std_m: NotNegative = 0.02
    vertical_std_m: NotNegative = 0.02
    velocity_std_m_s: NotNegative = 0.02
    correlation_s: Positive = 5.0
    """How slowly the position error wanders."""
    ground_offset_std_m: NotNegative = 0.0
    """Boot-to-boot error of the altitude."""


class Blackout(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A time in which nothing passes; counted from the first take-off [s of simulated time]."""

    from_s: NotNegative
    duration_s: Positive


class LinkSettings(LinkConditions, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One kind of link in the simulator."""

    blackouts: tuple[Blackout, ...] = ()


class Simulation(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the bundled simulator makes of the world beyond the mission itself."""

    positioning: Positioning = Positioning()
    ground_link: LinkSettings = LinkSettings()
    onboard_link: LinkSettings = LinkSettings()
    fleet_link: LinkSettings = LinkSettings()
    """Between any two companions."""
    wind_enu_m_s: Point3 = (0.0, 0.0, 0.0)
    gust_std_m_s: NotNegative = 0.0
    faults: tuple[SimulatorFault, ...] = ()


class Mission(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is to be flown, where and by whom. Positions are local ENU [m] around `origin`."""

    name: Name
    description: str = ""
    site: Site
    origin: GeodeticPoint
    world: World
    vehicles: Annotated[tuple[Vehicle, ...], msgspec.Meta(min_length=1, max_length=250)]
    targets: Annotated[tuple[Target, ...], msgspec.Meta(min_length=1, max_length=1000)]
    allocation: dict[str, str | tuple[str, ...]] | None = None
    """Vehicle name -> target name, or names in flying order; with none, it stays. Without it the planner allocates."""
    launch_point_m: Point3 | None = None
    """Where all curves begin; without it each begins above its vehicle's pad."""
    launch_zone_radius_m: NotNegative = 0.0
    """Near launch points and targets, limits of clearance, height and separation rest, but for contact."""
    takeoff_height_m: Positive
    on_arrival: OnArrival
    limits: Limits
    planner: PlannerSettings = PlannerSettings()
    onboard: OnboardSettings = OnboardSettings()
    sensor: RangeSensor = RangeSensor()
    simulation: Simulation = Simulation()
    set_parameters: bool = False
    """Consent: the GCS may set the autopilots' safety parameters (docs/mavlink.md) before arming."""

    @property
    def frame(self) -> LocalFrame:
        return LocalFrame(self.origin)

    @property
    def digest(self) -> int:
        """CRC-32 over everything in the mission: two programs with the same digest have read the same mission."""
        return zlib.crc32(msgspec.json.encode(self, order="deterministic"))

    @property
    def routes(self) -> dict[str, tuple[str, ...]] | None:
        """Vehicle name -> names of its targets in flying order, as the mission allocates them; None if it does not."""
        if self.allocation is None:
            return None
        return {name: (given,) if isinstance(given, str) else given for name, given in self.allocation.items()}

    def vehicle(self, sysid: int) -> Vehicle:
        """The vehicle with this MAVLink system id.

        Raises:
            MissionError: there is none.
        """
        for vehicle in self.vehicles:
            if vehicle.sysid == sysid:
                return vehicle
        known = ", ".join(str(vehicle.sysid) for vehicle in self.vehicles)
        raise MissionError(f"mission {self.name} has no vehicle with system id {sysid}, it has {known}")

    def start_m(self, vehicle: Vehicle) -> np.ndarray:
        """(3,) where the vehicle's planned curve begins: the common launch point, or above its pad."""
        if self.launch_point_m is not None:
            return np.array(self.launch_point_m)
        return np.array(vehicle.pad_m) + np.array([0.0, 0.0, self.takeoff_height_m])

    def moved_to(self, origin: GeodeticPoint) -> "Mission":
        """The same mission somewhere else on earth."""
        return msgspec.structs.replace(self, origin=origin)


def shipped_missions() -> list[str]:
    """Names of the missions that come with the project."""
    return sorted(path.stem for path in SHIPPED.glob("*.yaml"))


def load_mission(path_or_name: str | Path) -> Mission:
    """Read and check a mission file, given by its path or by the name of a shipped mission.

    Raises:
        ConfigError: with file, line, key, what was expected and what was found.
    """
    path = _find(path_or_name)
    mission, source = load_struct(path, Mission)
    for key, problem in contradictions(mission):
        raise source.error(key, problem)
    return mission


def contradictions(mission: Mission) -> Iterator[tuple[str, str]]:
    """Yield (key path, problem) for all that is wrong between the parts of a mission."""
    yield from _doubled("vehicles", "name", [vehicle.name for vehicle in mission.vehicles])
    yield from _doubled("vehicles", "sysid", [vehicle.sysid for vehicle in mission.vehicles])
    yield from _doubled("targets", "name", [target.name for target in mission.targets])
    yield from _misplaced(mission)
    yield from _crowded(mission)
    yield from _misallocated(mission)


def _find(path_or_name: str | Path) -> Path:
    path = Path(path_or_name)
    if path.exists() or path.suffix or len(path.parts) != 1:
        return path
    shipped = SHIPPED / f"{path}.yaml"
    if not shipped.exists():
        names = ", ".join(shipped_missions())
        raise ConfigError(path, None, "", f"no such file, and no shipped mission of that name; shipped are: {names}")
    return shipped


def _doubled(table: str, key: str, values: list[str] | list[int]) -> Iterator[tuple[str, str]]:
    for index, value in enumerate(values):
        if value in values[:index]:
            yield f"{table}[{index}].{key}", f"{value!r} is used twice"


def _misplaced(mission: Mission) -> Iterator[tuple[str, str]]:
    """What lies outside of the flight range or inside of something solid that is known."""
    bounds, body_m = mission.world.bounds, mission.limits.body_radius_m
    solid = obstacles.pack(mission.world.as_known())
    places = [(f"targets[{i}].position_m", target.position_m) for i, target in enumerate(mission.targets)]
    places += [(f"vehicles[{i}].pad_m", vehicle.pad_m) for i, vehicle in enumerate(mission.vehicles)]
    if mission.launch_point_m is not None:
        places.append(("launch_point_m", mission.launch_point_m))
    for key, place in places:
        text = "[" + ", ".join(f"{coordinate:g}" for coordinate in place) + "]"
        if not bounds.contains(place):
            yield key, f"{text} lies outside of world.bounds"
        elif (free_m := float(obstacles.clearance(np.array([place]), solid)[0])) < body_m:
            yield key, f"{text} has {free_m:.2f} m clearance, a vehicle needs {body_m:g} m"


def _crowded(mission: Mission) -> Iterator[tuple[str, str]]:
    least_m = mission.site.pad_spacing_m
    for i, vehicle in enumerate(mission.vehicles):
        for other in mission.vehicles[:i]:
            apart_m = math.dist(vehicle.pad_m, other.pad_m)
            if apart_m < least_m:
                problem = f"stands {apart_m:.2f} m from the pad of {other.name}, expected at least {least_m:g} m"
                yield f"vehicles[{i}].pad_m", problem


def _misallocated(mission: Mission) -> Iterator[tuple[str, str]]:
    if mission.routes is None:
        return
    vehicles = {vehicle.name for vehicle in mission.vehicles}
    targets = {target.name for target in mission.targets}
    for vehicle, route in mission.routes.items():
        if vehicle not in vehicles:
            yield (
                f"allocation.{vehicle}",
                f"expected one of the vehicles {sorted(vehicles)}, found {vehicle!r}",
            )
        for target in route:
            if target not in targets:
                yield f"allocation.{vehicle}", f"expected one of the targets {sorted(targets)}, found {target!r}"
    given = [target for route in mission.routes.values() for target in route]
    if not given:
        yield "allocation", "expected a target for one vehicle at least, found none"
    if len(set(given)) < len(given):
        yield "allocation", "one target is given to two vehicles, or twice to one"
    if missing := vehicles - mission.routes.keys():
        yield "allocation", f"expected every vehicle, {', '.join(sorted(missing))} is missing"
