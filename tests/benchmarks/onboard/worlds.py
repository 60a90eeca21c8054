"""What is flown through: the rooms and forests of the protocol, laid out by a seed; everything in them is unknown."""

from collections.abc import Callable
from dataclasses import dataclass

import msgspec
import numpy as np
import numpy.typing as npt

from missions.mission import (
    Limits,
    Mission,
    OnboardSettings,
    PlannerSettings,
    RangeSensor,
    Target,
    Vehicle,
    load_mission,
)
from missions.world import Bounds, Box, Cylinder, Mover, World

Array = npt.NDArray[np.float64]

LIMITS = Limits(
    cruise_speed_m_s=3.0,
    avoidance_speed_m_s=3.0,
    avoidance_distance_m=0.0,
    acceleration_m_s2=6.0,
    climb_angle_deg=60.0,
    clearance_m=0.3,
    height_m=0.4,
    separation_m=0.6,
    range_m=500.0,
    endurance_s=600.0,
    body_radius_m=0.2,
)
"""Body 0.20 m, 0.10 m more to be kept; the avoidance speed is the cruise speed."""
PLANNER = PlannerSettings(clearance_cap_m=0.5)
ONBOARD = OnboardSettings(horizon_m=7.5, voxel_m=0.1)
SENSOR = RangeSensor()
HEIGHT_M = 1.5


@dataclass(frozen=True)
class Course:
    """A world, and who is to cross it.

    Args:
        name: of the kind of world.
        seed: that laid it out.
        mission: its world is unknown to the planners.
        starts_m: (n, 3) where the vehicles begin at rest, ENU.
        goals_m: (n, 3) where they are to come to rest, ENU.
    """

    name: str
    seed: int
    mission: Mission
    starts_m: Array
    goals_m: Array


def course(name: str, seed: int, world: World, starts_m: Array, goals_m: Array) -> Course:
    """A course with as many vehicles as starts."""
    vehicles = tuple(
        Vehicle(name=f"v{i + 1}", sysid=i + 1, pad_m=(float(m[0]), float(m[1]), 0.0)) for i, m in enumerate(starts_m)
    )
    targets = tuple(
        Target(name=f"t{i + 1}", position_m=(float(m[0]), float(m[1]), float(m[2]))) for i, m in enumerate(goals_m)
    )
    mission = msgspec.structs.replace(
        load_mission("indoor"),
        world=world,
        vehicles=vehicles,
        targets=targets,
        allocation={vehicle.name: target.name for vehicle, target in zip(vehicles, targets, strict=True)},
        limits=LIMITS,
        planner=PLANNER,
        onboard=ONBOARD,
        sensor=SENSOR,
        takeoff_height_m=HEIGHT_M,
        launch_zone_radius_m=0.0,
    )
    return Course(name, seed, mission, np.asarray(starts_m, dtype=float), np.asarray(goals_m, dtype=float))


def room_world(seed: int, movers: tuple[Mover, ...] = ()) -> World:
    """The paper's room; other seeds than 0 move its obstacles by up to 1.5 m and resize them by up to 30 %."""
    rng = np.random.default_rng((seed, 1))
    shift = (rng.uniform(-1.5, 1.5, 4) * (seed > 0)).tolist()
    scale = (1.0 + rng.uniform(-0.3, 0.3, 2) * (seed > 0)).tolist()
    return World(
        bounds=Bounds(east_m=(0.0, 20.0), north_m=(0.0, 15.0), up_m=(0.0, 4.0)),
        boxes=(
            Box(
                name="crate",
                centre_m=(7.0 + shift[0], 7.0 + shift[1], 2.0),
                half_m=(0.75 * scale[0], 1.5 * scale[0], 2.0),
                known=False,
            ),
        ),
        cylinders=(
            Cylinder(
                name="column",
                centre_m=(13.0 + shift[2], 8.0 + shift[3]),
                radius_m=1.0 * scale[1],
                top_m=3.0,
                known=False,
            ),
        ),
        movers=movers,
    )


def room(seed: int) -> Course:
    """The paper's first vehicle crosses the room."""
    return course("room", seed, room_world(seed), np.array([[1.0, 6.5, HEIGHT_M]]), np.array([[19.0, 8.5, HEIGHT_M]]))


def dynamic(seed: int) -> Course:
    """The room with four balls that shuttle across the way."""
    rng = np.random.default_rng((seed, 2))
    movers = []
    for number, east_m in enumerate((4.0, 9.5, 10.5, 16.0)):
        low, high, up = (float(rng.uniform(*bounds)) for bounds in ((2.0, 4.0), (11.0, 13.0), (1.2, 1.8)))
        ends = [(east_m + float(rng.uniform(-0.8, 0.8)), north_m, up) for north_m in (low, high)]
        if rng.random() < 0.5:
            ends.reverse()
        speed_m_s = float(rng.uniform(0.5, 1.5))
        movers.append(Mover(name=f"ball {number}", from_m=ends[0], to_m=ends[1], radius_m=0.3, speed_m_s=speed_m_s))
    world = room_world(seed, tuple(movers))
    return course("dynamic", seed, world, np.array([[1.0, 6.5, HEIGHT_M]]), np.array([[19.0, 8.5, HEIGHT_M]]))


def forest_world(n: int, seed: int) -> World:
    """`n` columns as high as the flight range, no two centres nearer to each other than 0.8 m."""
    rng = np.random.default_rng((seed, n))
    centres: list[Array] = []
    while len(centres) < n:
        centre = rng.uniform((-13.0, -10.0), (13.0, 10.0))
        if all(np.hypot(*(centre - other)) >= 0.8 for other in centres):
            centres.append(centre)
    trees = tuple(
        Cylinder(
            name=f"tree {i}",
            centre_m=(float(c[0]), float(c[1])),
            radius_m=float(rng.uniform(0.2, 0.35)),
            top_m=3.0,
            known=False,
        )
        for i, c in enumerate(centres)
    )
    return World(bounds=Bounds(east_m=(-15.0, 15.0), north_m=(-10.0, 10.0), up_m=(0.0, 3.0)), cylinders=trees)


def forest(n: int) -> Callable[[int], Course]:
    """A vehicle crosses a forest of `n` trees."""

    def laid_out(seed: int) -> Course:
        starts_m, goals_m = np.array([[-14.5, 0.0, HEIGHT_M]]), np.array([[14.5, 0.0, HEIGHT_M]])
        return course(f"forest{n}", seed, forest_world(n, seed), starts_m, goals_m)

    return laid_out


COURSES: dict[str, Callable[[int], Course]] = {
    "room": room,
    "forest50": forest(50),
    "forest100": forest(100),
    "forest200": forest(200),
    "dynamic": dynamic,
}
"""One vehicle's worlds by name."""
