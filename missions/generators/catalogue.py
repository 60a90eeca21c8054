"""All kinds of generated missions by name."""

from collections.abc import Callable
from enum import Enum

from missions.errors import MissionError
from missions.generators import indoor, outdoor
from missions.mission import Mission, contradictions


class Kind(Enum):
    """What is generated."""

    TERRAIN = "terrain"
    FLEET = "fleet"
    MAZE = "maze"
    FOREST = "forest"
    CANYON = "canyon"
    FLOORS = "floors"


HARD = (Kind.MAZE, Kind.FOREST, Kind.CANYON, Kind.FLOORS)
"""The kinds in which obstacles decide: straight lines, and lines bent once, lead into something."""

_GENERATORS: dict[Kind, tuple[Callable[[int, int], Mission], int, int]] = {
    Kind.TERRAIN: (outdoor.terrain, 5, 10),
    Kind.FLEET: (outdoor.fleet, 50, 250),
    Kind.MAZE: (indoor.maze, 3, 4),
    Kind.FOREST: (indoor.forest, 4, 6),
    Kind.CANYON: (outdoor.canyon, 5, 10),
    Kind.FLOORS: (indoor.floors, 2, 4),
}
"""Generator, usual number of vehicles, greatest number of vehicles."""


def generate(kind: Kind, seed: int, vehicles: int | None = None) -> Mission:
    """The mission of this kind, seed and number of vehicles, checked like one that was read from a file.

    Raises:
        MissionError: there are no worlds of this kind for so many vehicles.
    """
    generator, usual, most = _GENERATORS[kind]
    count = usual if vehicles is None else vehicles
    if not 1 <= count <= most:
        raise MissionError(f"{kind.value}: expected 1 to {most} vehicles, found {count}")
    mission = generator(seed, count)
    wrong = [f"{key}: {problem}" for key, problem in contradictions(mission)]
    assert not wrong, f"{mission.name}: {wrong}"
    return mission
