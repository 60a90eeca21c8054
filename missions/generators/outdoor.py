"""Generated missions outdoors: terrains in the manner of the paper's Table 2, large fleets, canyons between peaks."""

import math

import msgspec
import numpy as np
import numpy.typing as npt

from missions.mission import Mission, Target, Vehicle, load_mission
from missions.world import Bounds, Peak, Point3, Threat, World

Array = npt.NDArray[np.float64]

TARGET_EAST_M = 2000.0
"""All targets lie in the plane x = 2000 m, as the paper's do."""

TERRAIN_TARGETS_M = ((560.0, 1400.0), (140.0, 900.0))
"""Range of the targets' northings and heights: that of Table 2."""
TERRAIN_TARGET_SPACING_M = 90.0
MEAN_DISTANCE_M = (130.0, 480.0)
"""From each target to the others: paths from one point make half of it, and limits are 50 m and 300 m."""
START_RADII = 2.5
TARGET_SPARE_M = 100.0

FLEET_GRID_M = 30.0
FLEET_TARGETS_M = ((300.0, 1500.0), (140.0, 900.0))
FLEET_TARGET_SPACING_M = 25.0
FLEET_MEAN_SEPARATION_M = (50.0, 500.0)

CANYON_CEILING_M = 350.0
CANYON_RANGES_EAST_M = (500.0, 1000.0, 1500.0)
CANYON_LAUNCH_M = (0.0, 1000.0, 0.0)
CANYON_TARGETS_M = ((600.0, 1400.0), (60.0, 300.0))


def terrain(seed: int, vehicles: int) -> Mission:
    """A terrain in the manner of Table 2: one launch point, two or three peaks and one or two threats in the way."""
    rng = np.random.default_rng([seed, vehicles])
    targets_m = _spread_targets(rng, vehicles, TERRAIN_TARGETS_M, TERRAIN_TARGET_SPACING_M, MEAN_DISTANCE_M)
    template = load_mission("terrain-1-5uav")
    world = _obstructed(rng, template.world.bounds, np.zeros((1, 3)), targets_m)
    launch_m = (0.0, 0.0, 0.0)
    return msgspec.structs.replace(
        template,
        name=f"terrain-{vehicles}uav-seed-{seed}",
        description=f"Random terrain {seed}, {vehicles} UAVs from one launch point",
        world=world,
        vehicles=_ring_of_pads(launch_m, vehicles),
        targets=_targets(targets_m),
        launch_point_m=launch_m,
    )


def fleet(seed: int, vehicles: int) -> Mission:
    """Many vehicles from a grid of pads in the corner to as many random targets; the planner allocates."""
    rng = np.random.default_rng([seed, vehicles])
    template = load_mission("terrain-1-5uav")
    side = math.ceil(math.sqrt(vehicles))
    pads_m = [(FLEET_GRID_M * (i // side), FLEET_GRID_M * (i % side), 0.0) for i in range(vehicles)]
    targets_m = _spread_targets(rng, vehicles, FLEET_TARGETS_M, FLEET_TARGET_SPACING_M, (0.0, math.inf))
    limits = msgspec.structs.replace(template.limits, mean_separation_m=FLEET_MEAN_SEPARATION_M)
    return msgspec.structs.replace(
        template,
        name=f"fleet-{vehicles}-seed-{seed}",
        description=f"{vehicles} UAVs from a grid of pads to random targets, terrain {seed}",
        world=_obstructed(rng, template.world.bounds, np.array(pads_m), targets_m),
        vehicles=_vehicles(pads_m),
        targets=_targets(targets_m),
        launch_point_m=None,
        limits=limits,
    )


def canyon(seed: int, vehicles: int) -> Mission:
    """Three ranges of peaks higher than vehicles may fly: the ways are the saddles between them."""
    rng = np.random.default_rng([seed, vehicles])
    targets_m = _spread_targets(rng, vehicles, CANYON_TARGETS_M, 90.0, MEAN_DISTANCE_M)
    template = load_mission("terrain-1-5uav")
    bounds = Bounds(east_m=(-50.0, 2050.0), north_m=(0.0, 2000.0), up_m=(0.0, CANYON_CEILING_M))
    return msgspec.structs.replace(
        template,
        name=f"canyon-seed-{seed}",
        description=f"Three ranges of peaks with narrow saddles, {vehicles} UAVs",
        world=World(
            bounds=bounds, peaks=tuple(peak for east_m in CANYON_RANGES_EAST_M for peak in _range(rng, east_m))
        ),
        vehicles=_ring_of_pads(CANYON_LAUNCH_M, vehicles),
        targets=_targets(targets_m),
        launch_point_m=CANYON_LAUNCH_M,
    )


def _range(rng: np.random.Generator, east_m: float) -> list[Peak]:
    """Peaks from south to north; their feet overlap, so that the saddles lie a little above the plain."""
    peaks: list[Peak] = []
    north_m = rng.uniform(0.0, 150.0)
    while north_m < 2000.0:
        place = (round(east_m + rng.uniform(-60.0, 60.0), 1), round(north_m, 1))
        height_m, radius_m = round(rng.uniform(450.0, 600.0), 1), round(rng.uniform(130.0, 180.0), 1)
        name = f"peak-{east_m:g}-{len(peaks) + 1}"
        peaks.append(Peak(name=name, centre_m=place, radius_m=radius_m, height_m=height_m))
        north_m += rng.uniform(240.0, 330.0)
    return peaks


def _obstructed(rng: np.random.Generator, bounds: Bounds, starts_m: Array, targets_m: Array) -> World:
    """Two or three peaks and one or two threats on random straight lines, clear of all starts and targets."""
    n_peaks, n_threats = rng.integers(2, 4), rng.integers(1, 3)
    peaks: list[Peak] = []
    threats: list[Threat] = []
    for index in range(n_peaks):
        radius_m = round(rng.uniform(80.0, 220.0), 1)
        centre_m = _in_the_way(rng, starts_m, targets_m, radius_m)
        peaks.append(Peak(name=f"peak-{index + 1}", centre_m=centre_m, radius_m=radius_m))
    for index in range(n_threats):
        radius_m = round(rng.uniform(180.0, 400.0), 1)
        centre_m = _in_the_way(rng, starts_m, targets_m, radius_m)
        threats.append(Threat(name=f"threat-{index + 1}", centre_m=centre_m, radius_m=radius_m))
    return World(bounds=bounds, peaks=tuple(peaks), threats=tuple(threats))


def _in_the_way(rng: np.random.Generator, starts_m: Array, targets_m: Array, radius_m: float) -> tuple[float, float]:
    """A centre near the ground track of a random straight line, far enough from all starts and targets.

    From starts that is `START_RADII` radii, where nothing is left of a peak, so that they stand on level ground.
    """
    while True:
        start_m, target_m = starts_m[rng.integers(len(starts_m))], targets_m[rng.integers(len(targets_m))]
        on_line_m: Array = start_m + rng.uniform(0.2, 0.85) * (target_m - start_m)
        centre_m = np.round(on_line_m[:2] + rng.uniform(-radius_m, radius_m, 2), 1)
        from_start_m = np.linalg.norm(starts_m[:, :2] - centre_m, axis=1).min()
        from_target_m = np.linalg.norm(targets_m[:, :2] - centre_m, axis=1).min()
        if from_start_m > START_RADII * radius_m and from_target_m > radius_m + TARGET_SPARE_M:
            return float(centre_m[0]), float(centre_m[1])


def _spread_targets(
    rng: np.random.Generator,
    count: int,
    ranges_m: tuple[tuple[float, float], tuple[float, float]],
    spacing_m: float,
    mean_m: tuple[float, float],
) -> Array:
    """(count, 3) random targets, at least `spacing_m` apart, each in the mean `mean_m` away from the others."""
    (south_m, north_m), (low_m, high_m) = ranges_m
    while True:
        places = np.empty((0, 3))
        while len(places) < count:
            place = np.array([TARGET_EAST_M, rng.uniform(south_m, north_m), rng.uniform(low_m, high_m)]).round(1)
            if np.all(np.linalg.norm(places - place, axis=1) >= spacing_m):
                places = np.concatenate((places, place[None]))
        apart_m = np.linalg.norm(places[:, None] - places, axis=-1).sum(axis=1) / max(count - 1, 1)
        if count == 1 or np.all((apart_m >= mean_m[0]) & (apart_m <= mean_m[1])):
            return places


def _ring_of_pads(launch_m: Point3, vehicles: int) -> tuple[Vehicle, ...]:
    """Pads around a common launch point."""
    angles = [2.0 * math.pi * i / vehicles for i in range(vehicles)]
    return _vehicles(
        [(launch_m[0] + 10.0 * math.cos(a), launch_m[1] + 10.0 * math.sin(a), launch_m[2]) for a in angles]
    )


def _vehicles(pads_m: list[Point3]) -> tuple[Vehicle, ...]:
    return tuple(
        Vehicle(name=f"uav-{i + 1}", sysid=i + 1, pad_m=(round(east, 1), round(north, 1), up))
        for i, (east, north, up) in enumerate(pads_m)
    )


def _targets(places_m: Array) -> tuple[Target, ...]:
    return tuple(
        Target(name=f"target-{i + 1}", position_m=(east, north, up))
        for i, (east, north, up) in enumerate(places_m.tolist())
    )
