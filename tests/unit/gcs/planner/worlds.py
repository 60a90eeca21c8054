"""Missions for the planner's tests: rooms with walls, and one world that has an obstacle of every kind."""

import msgspec
import numpy as np

from missions.mission import Mission, Target, Vehicle, contradictions, load_mission
from missions.world import Bounds, Box, Cylinder, Peak, Point3, Threat, World

ROOM = Bounds(east_m=(0.0, 20.0), north_m=(0.0, 15.0), up_m=(0.0, 4.0))


def wall(east_m: float, gap_m: tuple[float, float] | None) -> tuple[Box, ...]:
    """A wall across the room from floor to ceiling, with a gap from one northing to another."""
    parts = [(0.0, 15.0)] if gap_m is None else [(0.0, gap_m[0]), (gap_m[1], 15.0)]
    return tuple(
        Box(
            name=f"wall-{east_m:g}-{low:g}",
            centre_m=(east_m, 0.5 * (low + high), 2.0),
            half_m=(0.15, 0.5 * (high - low), 2.0),
        )
        for low, high in parts
    )


def room(
    boxes: tuple[Box, ...] = (),
    pads_m: tuple[Point3, ...] = ((1.0, 6.0, 0.0), (1.0, 8.0, 0.0)),
    targets_m: tuple[Point3, ...] = ((19.0, 6.0, 1.5), (19.0, 8.0, 1.5)),
    **changes: object,
) -> Mission:
    """The indoor mission in another room; `changes` are fields of `Limits`."""
    indoor = load_mission("indoor")
    mission = msgspec.structs.replace(
        indoor,
        name="room",
        world=World(bounds=ROOM, boxes=boxes),
        vehicles=tuple(Vehicle(name=f"v{i + 1}", sysid=i + 1, pad_m=pad) for i, pad in enumerate(pads_m)),
        targets=tuple(Target(name=f"t{i + 1}", position_m=place) for i, place in enumerate(targets_m)),
        allocation=None,
        limits=msgspec.structs.replace(indoor.limits, **changes),
    )
    assert not list(contradictions(mission))
    return mission


def round_trip() -> Mission:
    """The indoor mission with a target for each vehicle on the way, far off the straight line."""
    indoor = load_mission("indoor")
    on_the_way = (
        Target(name="north", position_m=(10.0, 12.0, 1.5)),
        Target(name="south", position_m=(9.0, 3.0, 1.2)),
    )
    routes = {"alpha": ("south", "south-east"), "bravo": ("north", "north-east")}
    mission = msgspec.structs.replace(indoor, name="round-trip", targets=indoor.targets + on_the_way, allocation=routes)
    assert not list(contradictions(mission))
    return mission


def forest(count: int, seed: int) -> Mission:
    """Four vehicles across 30 m of random trunks from floor to ceiling, to permuted targets."""
    rng, centres = np.random.default_rng(seed), np.empty((0, 2))
    while len(centres) < count:
        centre = np.array([rng.uniform(-13.0, 13.0), rng.uniform(-10.0, 10.0)])
        if np.all(np.linalg.norm(centres - centre, axis=1) > 0.8):
            centres = np.concatenate((centres, centre[None]))
    trunks = tuple(
        Cylinder(name=f"trunk-{i}", centre_m=(east, north), radius_m=float(rng.uniform(0.2, 0.35)), top_m=3.0)
        for i, (east, north) in enumerate(centres.tolist())
    )
    order, norths = rng.permutation(4), (-6.0, -2.0, 2.0, 6.0)
    world = World(bounds=Bounds(east_m=(-15.0, 15.0), north_m=(-10.5, 10.5), up_m=(0.0, 3.0)), cylinders=trunks)
    mission = room(
        pads_m=tuple((1.0, 1.0 + 2.0 * i, 0.0) for i in range(4)),
        targets_m=tuple((19.0, 1.0 + 2.0 * i, 1.5) for i in range(4)),
        clearance_m=0.35,
        separation_m=0.6,
        avoidance_distance_m=0.4,
        mean_separation_m=(0.5, 30.0),
    )
    mission = msgspec.structs.replace(
        mission,
        world=world,
        vehicles=tuple(
            msgspec.structs.replace(vehicle, pad_m=(-14.4, north, 0.0))
            for vehicle, north in zip(mission.vehicles, norths, strict=True)
        ),
        targets=tuple(
            msgspec.structs.replace(target, position_m=(14.4, north, 1.5))
            for target, north in zip(mission.targets, norths, strict=True)
        ),
        allocation={f"v{i + 1}": f"t{order[i] + 1}" for i in range(4)},
        planner=msgspec.structs.replace(mission.planner, time_slack_s=1.0),
    )
    assert not list(contradictions(mission))
    return mission


def everything(**changes: object) -> Mission:
    """A terrain with peaks, threats, a box and a cylinder, and three vehicles through the middle of them."""
    terrain = load_mission("terrain-1-5uav")
    world = World(
        bounds=terrain.world.bounds,
        peaks=(
            Peak(name="hill", centre_m=(600.0, 300.0), radius_m=200.0),
            Peak(name="spike", centre_m=(1300.0, 700.0), radius_m=100.0, height_m=700.0),
        ),
        threats=(Threat(name="radar", centre_m=(1000.0, 900.0), radius_m=300.0),),
        boxes=(Box(name="block", centre_m=(1500.0, 400.0, 150.0), half_m=(60.0, 200.0, 150.0)),),
        cylinders=(Cylinder(name="tower", centre_m=(400.0, 700.0), radius_m=80.0, base_m=100.0, top_m=600.0),),
    )
    mission = msgspec.structs.replace(terrain, name="everything", world=world, **changes)
    return msgspec.structs.replace(mission, vehicles=terrain.vehicles[:3], targets=terrain.targets[:3])
