"""Changes of a mission, one at a time, each checked like a mission that is read from a file, and each to be undone.

A part of a mission is named by its kind and name; nothing but what the change says is touched.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from itertools import count

from msgspec.structs import replace

from missions.errors import MissionError
from missions.mission import Mission, contradictions
from missions.world import Box, Cylinder, Point3, Threat, World


class Kind(Enum):
    """What can be moved; the value is its word for an operator."""

    TARGET = "target"
    START = "start"
    BOX = "box"
    CYLINDER = "cylinder"
    THREAT = "no-fly area"


@dataclass(frozen=True)
class Part:
    """One thing of a mission."""

    kind: Kind
    name: str


Change = Callable[[Mission], Mission]
LEAST_SIZE_M = 0.05


def parts(mission: Mission) -> tuple[Part, ...]:
    """Everything in a mission that can be moved."""
    return (
        *(Part(Kind.TARGET, target.name) for target in mission.targets),
        *(Part(Kind.START, vehicle.name) for vehicle in mission.vehicles),
        *(Part(Kind.BOX, box.name) for box in mission.world.boxes),
        *(Part(Kind.CYLINDER, cylinder.name) for cylinder in mission.world.cylinders),
        *(Part(Kind.THREAT, threat.name) for threat in mission.world.threats),
    )


def place_m(mission: Mission, part: Part) -> Point3:
    """Where a part is, ENU [m]: a target, a pad, or the middle of a body.

    Raises:
        MissionError: the mission has no such part.
    """
    thing = _find(mission, part)
    match part.kind:
        case Kind.TARGET:
            return thing.position_m
        case Kind.START:
            return thing.pad_m
        case Kind.BOX:
            return thing.centre_m
        case Kind.CYLINDER:
            return (*thing.centre_m, (thing.base_m + thing.top_m) / 2)
        case Kind.THREAT:
            return (*thing.centre_m, 0.0)


def size_m(mission: Mission, part: Part) -> Point3 | None:
    """East, north and up extent [m] of a body; None of what has none."""
    thing = _find(mission, part)
    match part.kind:
        case Kind.BOX:
            return (2 * thing.half_m[0], 2 * thing.half_m[1], 2 * thing.half_m[2])
        case Kind.CYLINDER:
            return (2 * thing.radius_m, 2 * thing.radius_m, thing.top_m - thing.base_m)
        case Kind.THREAT:
            return (2 * thing.radius_m, 2 * thing.radius_m, thing.radius_m)
        case _:
            return None


def moved(part: Part, to_m: Point3) -> Change:
    """A part somewhere else, by its `place_m`; a no-fly area stays on the ground."""
    east, north, up = (round(float(value), 3) for value in to_m)

    def change(mission: Mission) -> Mission:
        thing = _find(mission, part)
        match part.kind:
            case Kind.TARGET:
                new = replace(thing, position_m=(east, north, up))
            case Kind.START:
                new = replace(thing, pad_m=(east, north, up))
            case Kind.BOX:
                new = replace(thing, centre_m=(east, north, up))
            case Kind.CYLINDER:
                half_m = (thing.top_m - thing.base_m) / 2
                new = replace(thing, centre_m=(east, north), base_m=up - half_m, top_m=up + half_m)
            case Kind.THREAT:
                new = replace(thing, centre_m=(east, north))
        return _with(mission, part, new)

    return change


def resized(part: Part, to_m: Point3) -> Change:
    """A body of another size around the same middle; round ones take their diameter from the first figure."""
    east, north, up = (max(round(float(value), 3), LEAST_SIZE_M) for value in to_m)

    def change(mission: Mission) -> Mission:
        thing = _find(mission, part)
        match part.kind:
            case Kind.BOX:
                new = replace(thing, half_m=(east / 2, north / 2, up / 2))
            case Kind.CYLINDER:
                middle_m = (thing.base_m + thing.top_m) / 2
                new = replace(thing, radius_m=east / 2, base_m=middle_m - up / 2, top_m=middle_m + up / 2)
            case Kind.THREAT:
                new = replace(thing, radius_m=east / 2)
            case _:
                raise MissionError(f"{part.kind.value} {part.name} has no size")
        return _with(mission, part, new)

    return change


def added(thing: Box | Cylinder | Threat) -> Change:
    """One more body."""

    def change(mission: Mission) -> Mission:
        world, table = mission.world, _TABLES[_KINDS[type(thing)]]
        return replace(mission, world=replace(world, **{table: (*getattr(world, table), thing)}))

    return change


def removed(part: Part) -> Change:
    """Without a body; targets and vehicles stay, since an allocation may name them."""

    def change(mission: Mission) -> Mission:
        if part.kind in {Kind.TARGET, Kind.START}:
            raise MissionError(f"{part.kind.value} {part.name}: only obstacles and no-fly areas can be removed")
        _find(mission, part)
        return _with(mission, part, None)

    return change


def free_name(world: World, word: str) -> str:
    """`word` with the first number that no body of this world has in its name."""
    taken = {thing.name for things in (world.boxes, world.cylinders, world.threats, world.peaks) for thing in things}
    return next(name for number in count(1) if (name := f"{word} {number}") not in taken)


class Draft:
    """A mission that is being changed.

    Args:
        mission: as it was before.
    """

    def __init__(self, mission: Mission) -> None:
        self._states, self._at = [mission], 0

    @property
    def mission(self) -> Mission:
        return self._states[self._at]

    @property
    def can_undo(self) -> bool:
        return self._at > 0

    @property
    def can_redo(self) -> bool:
        return self._at + 1 < len(self._states)

    def apply(self, change: Change) -> None:
        """Make a change; what was undone before is forgotten.

        Raises:
            MissionError: the mission would contradict itself; it stays as it was.
        """
        mission = change(self.mission)
        for key, problem in contradictions(mission):
            raise MissionError(f"{key}: {problem}")
        if mission != self.mission:
            self._states[self._at + 1 :] = [mission]
            self._at += 1

    def undo(self) -> None:
        self._at = max(self._at - 1, 0)

    def redo(self) -> None:
        self._at = min(self._at + 1, len(self._states) - 1)


_TABLES = {
    Kind.TARGET: "targets",
    Kind.START: "vehicles",
    Kind.BOX: "boxes",
    Kind.CYLINDER: "cylinders",
    Kind.THREAT: "threats",
}
_KINDS = {Box: Kind.BOX, Cylinder: Kind.CYLINDER, Threat: Kind.THREAT}


def _find(mission: Mission, part: Part):
    holder = mission if part.kind in {Kind.TARGET, Kind.START} else mission.world
    for thing in getattr(holder, _TABLES[part.kind]):
        if thing.name == part.name:
            return thing
    raise MissionError(f"mission {mission.name} has no {part.kind.value} {part.name}")


def _with(mission: Mission, part: Part, new: object | None) -> Mission:
    """The mission with a part replaced, or left out."""
    holder = mission if part.kind in {Kind.TARGET, Kind.START} else mission.world
    table = _TABLES[part.kind]
    things = (new if thing.name == part.name else thing for thing in getattr(holder, table))
    changed = {table: tuple(thing for thing in things if thing is not None)}
    if holder is mission:
        return replace(mission, **changed)
    return replace(mission, world=replace(mission.world, **changed))
