"""A mission of a hundred vehicles over a field, for pictures and for what only a large fleet shows."""

import msgspec

from missions.mission import Mission, Target, Vehicle, load_mission
from missions.world import Bounds, Box, Cylinder

ROWS, SPACING_M, ACROSS_M = 10, 6.0, 110.0
HEIGHT_M = 6.0
STRIDE = 37
"""Vehicle k flies to target 37 k: without a common divisor of it and their number, every target is somebody's."""


def large_fleet() -> Mission:
    """Ten rows of ten that change places across a field with some buildings."""
    field, count = load_mission("field"), ROWS**2
    grid = [(SPACING_M * (index // ROWS), SPACING_M * (index % ROWS)) for index in range(count)]
    bodies = [Box(name=f"block-{i}", centre_m=(78.0, 8.0 + 19.0 * i, 5.0), half_m=(4.0, 4.0, 5.0)) for i in range(3)]
    return msgspec.structs.replace(
        field,
        name="fleet-100",
        description="A hundred vehicles across a field",
        world=msgspec.structs.replace(
            field.world,
            bounds=Bounds(east_m=(-15.0, 180.0), north_m=(-30.0, 84.0), up_m=(0.0, 25.0)),
            boxes=tuple(bodies),
            cylinders=(Cylinder(name="tower", centre_m=(95.0, 27.0), radius_m=3.0, top_m=18.0),),
        ),
        vehicles=tuple(
            Vehicle(name=f"uav-{index + 1}", sysid=index + 1, pad_m=(*place, 0.0)) for index, place in enumerate(grid)
        ),
        targets=tuple(
            Target(name=f"t{index + 1}", position_m=(east + ACROSS_M, north, HEIGHT_M))
            for index, (east, north) in enumerate(grid)
        ),
        limits=msgspec.structs.replace(field.limits, separation_m=1.0, clearance_m=0.5),
        allocation={f"uav-{index + 1}": f"t{(STRIDE * index) % count + 1}" for index in range(count)},
    )
