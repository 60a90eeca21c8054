"""Worlds in which the map is right, lacks an obstacle, has it elsewhere, or hides a dead end."""

from dataclasses import dataclass
from enum import Enum

import msgspec
import numpy as np

from gcs.planner import plan_mission
from missions import obstacles
from missions.mission import Blackout, LinkSettings, Mission, contradictions, load_mission
from missions.world import Bounds, Box, Cylinder, World

PILLAR_RADIUS_M = 0.5
ROOM_AROUND_M = 1.4
"""An unmapped pillar leaves this much room to everything that is mapped, where the way does: there is a way past it."""
JITTER_M = 0.8
HALL = Bounds(east_m=(0.0, 48.0), north_m=(0.0, 19.0), up_m=(0.0, 4.0))
"""A dead end has to be deeper than a local planner's search for a way around reaches: it needs a hall."""
ALLEY_FROM_M = 7.0
ALLEY_DEPTH_M = (27.0, 30.0)
ALLEY_WIDTH_M = (6.5, 7.5)
ALLEY_OFF_M = 0.8
HALL_RANGE_M, HALL_ENDURANCE_S = 300.0, 150.0
WALL_HALF_M = 0.15


class Difference(Enum):
    """How the world differs from its map."""

    AS_MAPPED = "map right"
    MISSING = "obstacle missing from the map"
    MOVED = "obstacle moved"
    DEAD_END = "dead end"


class Link(Enum):
    """The ground link."""

    GOOD = "good"
    BAD = "300 ms, 10 % loss"
    BLACKOUT = "blackout"


LINKS = {
    Link.GOOD: LinkSettings(),
    Link.BAD: LinkSettings(delay_s=0.3, loss=0.1),
    Link.BLACKOUT: LinkSettings(blackouts=(Blackout(from_s=5.0, duration_s=30.0),)),
}


@dataclass(frozen=True)
class Scenario:
    """One flight's mission, as everybody is told, and the truth about it."""

    mission: Mission
    truth: Mission


def scenario(world: Difference, link: Link, seed: int) -> Scenario:
    """The scenario of a seed: the same world for every mode and link."""
    rng = np.random.default_rng([seed, list(Difference).index(world)])
    mission = _jittered(load_mission("indoor"), rng)
    truth = mission
    match world:
        case Difference.MISSING:
            truth = _with(mission, cylinders=(*mission.world.cylinders, _in_the_way(mission, seed, rng)))
        case Difference.MOVED:
            truth = _with(mission, cylinders=(_in_the_way(mission, seed, rng),))
        case Difference.DEAD_END:
            mission = _in_the_hall(mission)
            truth = _with(mission, boxes=_blind_alley(rng))
    ground_link = LINKS[link]
    return Scenario(_linked(mission, ground_link), _linked(truth, ground_link))


def _jittered(mission: Mission, rng: np.random.Generator) -> Mission:
    """The paper's room with its two obstacles somewhat elsewhere."""
    while True:
        (crate,), (column,) = mission.world.boxes, mission.world.cylinders
        shift_m = rng.uniform(-JITTER_M, JITTER_M, (2, 2))
        east_m, north_m = np.array(crate.centre_m[:2]) + shift_m[0]
        crate = msgspec.structs.replace(crate, centre_m=(float(east_m), float(north_m), crate.centre_m[2]))
        east_m, north_m = np.array(column.centre_m) + shift_m[1]
        column = msgspec.structs.replace(column, centre_m=(float(east_m), float(north_m)))
        moved = _with(mission, boxes=(crate,), cylinders=(column,))
        if not list(contradictions(moved)):
            return moved


def _in_the_way(mission: Mission, seed: int, rng: np.random.Generator) -> Cylinder:
    """A pillar on the curve that the cloud plans for one of the vehicles, clear of everything that is mapped."""
    plan, solid = plan_mission(mission, seed=seed), obstacles.pack(mission.world)
    curve_m = plan.vehicles[int(rng.integers(len(plan.vehicles)))].curve_m
    places_m = curve_m[int(0.3 * len(curve_m)) : int(0.75 * len(curve_m))]
    free_m = obstacles.clearance(places_m, solid)
    roomy = np.flatnonzero(free_m >= PILLAR_RADIUS_M + ROOM_AROUND_M)
    return _pillar(places_m[rng.choice(roomy)] if len(roomy) else places_m[int(np.argmax(free_m))])


def _pillar(place_m: np.ndarray) -> Cylinder:
    middle_m = (float(place_m[0]), float(place_m[1]))
    return Cylinder(name="pillar", centre_m=middle_m, radius_m=PILLAR_RADIUS_M, top_m=4.0)


def _in_the_hall(mission: Mission) -> Mission:
    """The same two vehicles, in an empty hall, to crossed targets at its other end."""
    middle_m = 0.5 * sum(HALL.north_m)
    shift_m = middle_m - float(np.mean([vehicle.pad_m[1] for vehicle in mission.vehicles]))
    vehicles = [
        msgspec.structs.replace(vehicle, pad_m=(vehicle.pad_m[0], vehicle.pad_m[1] + shift_m, 0.0))
        for vehicle in mission.vehicles
    ]
    targets = [
        msgspec.structs.replace(target, position_m=(HALL.east_m[1] - 1.5, target.position_m[1] + shift_m, 1.5))
        for target in mission.targets
    ]
    return msgspec.structs.replace(
        mission,
        world=World(bounds=HALL),
        vehicles=tuple(vehicles),
        targets=tuple(targets),
        limits=msgspec.structs.replace(mission.limits, range_m=HALL_RANGE_M, endurance_s=HALL_ENDURANCE_S),
    )


def _blind_alley(rng: np.random.Generator) -> tuple[Box, ...]:
    """Two walls, between which the vehicles fly, and one that joins them at the far end; from floor to ceiling."""
    depth_m, width_m = rng.uniform(*ALLEY_DEPTH_M), rng.uniform(*ALLEY_WIDTH_M)
    middle_m, half = 0.5 * sum(HALL.north_m) + rng.uniform(-ALLEY_OFF_M, ALLEY_OFF_M), WALL_HALF_M
    walls = [((ALLEY_FROM_M + depth_m, middle_m, 2.0), (half, 0.5 * width_m + half, 2.0))]
    for side in (-0.5, 0.5):
        walls.append(((ALLEY_FROM_M + 0.5 * depth_m, middle_m + side * width_m, 2.0), (0.5 * depth_m, half, 2.0)))
    return tuple(Box(name=f"wall {n}", centre_m=c, half_m=h) for n, (c, h) in enumerate(walls))


def _with(mission: Mission, **parts: tuple) -> Mission:
    return msgspec.structs.replace(mission, world=msgspec.structs.replace(mission.world, **parts))


def _linked(mission: Mission, ground_link: LinkSettings) -> Mission:
    simulation = msgspec.structs.replace(mission.simulation, ground_link=ground_link)
    return msgspec.structs.replace(mission, simulation=simulation)
