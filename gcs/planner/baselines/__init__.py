"""The algorithms that the paper compares its planner with, in one frame: same problem, costs, budget and judge.

Layers, each importing only what stands below it:

    search                          one algorithm on one mission, judged
    searchers                       all vehicles at once, or in turn
    absolute, offsets               the paper's representation, and ours
    algorithms                      by name
    pso, ipso, gapso, brain_storm, ant_colony, adaptive    one algorithm each
    optimiser                       what they have in common: ask, tell
"""

from gcs.planner.baselines.algorithms import BASELINES, COMPARED
from gcs.planner.baselines.search import BaselineSearch
from gcs.planner.baselines.searchers import Representation

__all__ = ["BASELINES", "COMPARED", "BaselineSearch", "Representation"]
