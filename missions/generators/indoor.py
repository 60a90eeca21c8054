"""Generated missions indoors: mazes of walls with gaps, dense forests of trunks, floors above one another."""

from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt
from scipy import ndimage

from missions import obstacles
from missions.mission import Mission, Target, Vehicle, load_mission
from missions.world import Bounds, Box, Cylinder, Point3, World

Array = npt.NDArray[np.float64]

MAZE = Bounds(east_m=(0.0, 24.0), north_m=(0.0, 15.0), up_m=(0.0, 4.0))
MAZE_WALLS_EAST_M = (5.0, 9.5, 14.0, 18.5)
WALL_HALF_M = 0.15
MAZE_GAP_M = (2.4, 3.2)

FOREST = Bounds(east_m=(-15.0, 15.0), north_m=(-10.5, 10.5), up_m=(0.0, 3.0))
FOREST_TRUNKS = (80, 150)
"""The fewest and the most trunks."""
FOREST_CLEARANCE_M = 0.35
TRUNK_SPACING_M = 0.8

FLOORS = Bounds(east_m=(0.0, 20.0), north_m=(0.0, 12.0), up_m=(0.0, 9.0))
STOREY_M = 3.0
SLAB_HALF_M = 0.1
FLOOR_OPENING_M = (5.0, 6.0)
"""Range of the lengths of the openings: enough for a climb at 45 degrees with clearance above and below."""


def maze(seed: int, vehicles: int) -> Mission:
    """Walls from floor to ceiling across a room, each with one gap, mostly on the other side than the last one's."""
    rng = np.random.default_rng([seed, vehicles])
    south = bool(rng.integers(2))
    walls: list[Box] = []
    for east_m in MAZE_WALLS_EAST_M:
        width_m = rng.uniform(*MAZE_GAP_M)
        inset_m = rng.uniform(0.4, 3.5)
        low_m = inset_m if south else MAZE.north_m[1] - inset_m - width_m
        walls += _wall(east_m, round(low_m, 2), round(low_m + width_m, 2))
        south = south if rng.random() < 0.2 else not south
    norths_m = np.linspace(3.0, 12.0, vehicles).round(2)
    return _mission(
        f"maze-seed-{seed}",
        "Walls with one gap each, from floor to ceiling",
        World(bounds=MAZE, boxes=tuple(walls)),
        pads_m=[(1.5, north_m, 0.0) for north_m in norths_m.tolist()],
        targets_m=[(22.5, north_m, 1.5) for north_m in rng.permutation(norths_m).tolist()],
        time_slack_s=0.5,
        limits={"clearance_m": 0.5, "separation_m": 0.8, "mean_separation_m": (0.5, 20.0), "range_m": 120.0},
    )


def forest(seed: int, vehicles: int) -> Mission:
    """Random trunks from floor to ceiling; between them there is a way for a vehicle with its clearance."""
    rng = np.random.default_rng([seed, vehicles])
    norths_m = np.linspace(-6.0, 6.0, vehicles).round(2)
    pads_m = [(-14.4, north_m, 0.0) for north_m in norths_m.tolist()]
    targets_m = [(14.4, north_m, 1.5) for north_m in rng.permutation(norths_m).tolist()]
    ends_m = np.array([(east, north, 1.5) for east, north, _ in pads_m + targets_m])
    while True:
        world = World(bounds=FOREST, cylinders=_trunks(rng, int(rng.integers(*FOREST_TRUNKS))))
        if _connected(world, ends_m, 1.15 * FOREST_CLEARANCE_M):
            break
    return _mission(
        f"forest-seed-{seed}",
        f"{len(world.cylinders)} trunks in 26 m x 20 m",
        world,
        pads_m,
        targets_m,
        time_slack_s=0.5,
        limits={
            "clearance_m": FOREST_CLEARANCE_M,
            "separation_m": 0.6,
            "avoidance_distance_m": 0.4,
            "mean_separation_m": (0.5, 30.0),
            "range_m": 90.0,
        },
    )


def floors(seed: int, vehicles: int) -> Mission:
    """Three storeys with one opening in each slab, on opposite sides; from the ground floor to the top one."""
    rng = np.random.default_rng([seed, vehicles])
    east_first = bool(rng.integers(2))
    slabs: list[Box] = []
    for level in (1, 2):
        length_m, width_m = rng.uniform(*FLOOR_OPENING_M), rng.uniform(3.0, 4.0)
        at_east = east_first == (level == 1)
        west_m = rng.uniform(13.0, 13.8) if at_east else rng.uniform(1.2, 2.0)
        south_m = rng.uniform(1.0, 7.0)
        opening = (west_m, west_m + length_m, south_m, south_m + width_m)
        slabs += _slab(level, *(round(side_m, 2) for side_m in opening))
    begin_m, end_m = (1.5, 18.5) if east_first else (18.5, 1.5)
    norths_m = np.linspace(3.0, 9.0, vehicles).round(2)
    return _mission(
        f"floors-seed-{seed}",
        "Three storeys, one opening in each slab",
        World(bounds=FLOORS, boxes=tuple(slabs)),
        pads_m=[(begin_m, north_m, 0.0) for north_m in norths_m.tolist()],
        targets_m=[(end_m, north_m, 2.0 * STOREY_M + 1.5) for north_m in rng.permutation(norths_m).tolist()],
        time_slack_s=0.5,
        limits={
            "clearance_m": 0.5,
            "separation_m": 0.8,
            "climb_angle_deg": 45.0,
            "mean_separation_m": (0.5, 20.0),
            "range_m": 120.0,
        },
    )


def _mission(
    name: str,
    description: str,
    world: World,
    pads_m: list[Point3],
    targets_m: list[Point3],
    time_slack_s: float,
    limits: dict[str, Any],
) -> Mission:
    """The shipped indoor mission in another world; vehicle i flies to target i."""
    template = load_mission("indoor")
    vehicles = tuple(Vehicle(name=f"uav-{i + 1}", sysid=i + 1, pad_m=pad) for i, pad in enumerate(pads_m))
    targets = tuple(Target(name=f"target-{i + 1}", position_m=place) for i, place in enumerate(targets_m))
    return msgspec.structs.replace(
        template,
        name=name,
        description=description,
        world=world,
        vehicles=vehicles,
        targets=targets,
        allocation={vehicle.name: target.name for vehicle, target in zip(vehicles, targets, strict=True)},
        limits=msgspec.structs.replace(template.limits, **limits),
        planner=msgspec.structs.replace(template.planner, time_slack_s=time_slack_s),
    )


def _wall(east_m: float, gap_low_m: float, gap_high_m: float) -> list[Box]:
    (south_m, north_m), top_m = MAZE.north_m, MAZE.up_m[1]
    parts = {"south": (south_m, gap_low_m), "north": (gap_high_m, north_m)}
    return [
        Box(
            name=f"wall-{east_m:g}-{side}",
            centre_m=(east_m, 0.5 * (low_m + high_m), 0.5 * top_m),
            half_m=(WALL_HALF_M, 0.5 * (high_m - low_m), 0.5 * top_m),
        )
        for side, (low_m, high_m) in parts.items()
    ]


def _slab(level: int, west_m: float, east_m: float, south_m: float, north_m: float) -> list[Box]:
    """The four rectangles around an opening from `west_m` to `east_m` and from `south_m` to `north_m`."""
    (far_west_m, far_east_m), (far_south_m, far_north_m) = FLOORS.east_m, FLOORS.north_m
    parts = {
        "west": (far_west_m, west_m, far_south_m, far_north_m),
        "east": (east_m, far_east_m, far_south_m, far_north_m),
        "south": (west_m, east_m, far_south_m, south_m),
        "north": (west_m, east_m, north_m, far_north_m),
    }
    return [
        Box(
            name=f"slab-{level}-{side}",
            centre_m=(0.5 * (x_low + x_high), 0.5 * (y_low + y_high), level * STOREY_M),
            half_m=(0.5 * (x_high - x_low), 0.5 * (y_high - y_low), SLAB_HALF_M),
        )
        for side, (x_low, x_high, y_low, y_high) in parts.items()
    ]


def _trunks(rng: np.random.Generator, count: int) -> tuple[Cylinder, ...]:
    centres_m = np.empty((0, 2))
    while len(centres_m) < count:
        centre_m = np.array([rng.uniform(-13.0, 13.0), rng.uniform(-10.0, 10.0)]).round(2)
        if np.all(np.linalg.norm(centres_m - centre_m, axis=1) >= TRUNK_SPACING_M):
            centres_m = np.concatenate((centres_m, centre_m[None]))
    radii_m = rng.uniform(0.2, 0.35, count).round(3)
    return tuple(
        Cylinder(name=f"trunk-{i + 1}", centre_m=(east, north), radius_m=radius_m, top_m=FOREST.up_m[1])
        for i, ((east, north), radius_m) in enumerate(zip(centres_m.tolist(), radii_m.tolist(), strict=True))
    )


def _connected(world: World, places_m: Array, clearance_m: float, cell_m: float = 0.1) -> bool:
    """Whether ways with this clearance, at the places' height, connect all (n, 3) places."""
    inset_m = 0.5 * clearance_m
    low_m, high_m = world.bounds.low_enu_m + inset_m, world.bounds.high_enu_m - inset_m
    east_m, north_m = np.arange(low_m[0], high_m[0], cell_m), np.arange(low_m[1], high_m[1], cell_m)
    grid = np.stack(np.meshgrid(east_m, north_m, indexing="ij"), axis=-1).reshape(-1, 2)
    points = np.column_stack((grid, np.full(len(grid), places_m[0, 2])))
    free = obstacles.clearance(points, obstacles.pack(world)).reshape(len(east_m), len(north_m)) >= clearance_m
    regions = np.zeros(free.shape, np.int32)
    ndimage.label(free, output=regions)
    cells = np.round((places_m - low_m) / cell_m).astype(int)
    found = regions[cells[:, 0], cells[:, 1]]
    return bool(found[0] != 0 and np.all(found == found[0]))
