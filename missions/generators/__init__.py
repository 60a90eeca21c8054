"""Seeded missions: worlds that nobody has seen before, for benchmarks and tests.

One kind, seed and number of vehicles are one mission, on every machine and for good: benchmarks name their worlds by
them. Limits are those of the shipped missions where nothing speaks against it. A mission is written as a file with
`python -m missions.generators maze --seed 3 --output maze-3.yaml`.
"""

from missions.generators.catalogue import HARD, Kind, generate
from missions.generators.indoor import floors, forest, maze
from missions.generators.outdoor import canyon, fleet, terrain

__all__ = ["HARD", "Kind", "canyon", "fleet", "floors", "forest", "generate", "maze", "terrain"]
