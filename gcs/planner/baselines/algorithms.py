"""The compared algorithms by name."""

from collections.abc import Callable

import numpy as np

from gcs.planner.baselines.adaptive import AdaptiveSwarm
from gcs.planner.baselines.ant_colony import AntColony
from gcs.planner.baselines.brain_storm import BrainStorm
from gcs.planner.baselines.gapso import Gapso
from gcs.planner.baselines.ipso import Ipso
from gcs.planner.baselines.optimiser import Optimiser, SearchSpace
from gcs.planner.baselines.pso import Pso

NewOptimiser = Callable[[SearchSpace, int, np.random.Generator], Optimiser]
"""From a space, a population and a source of randomness."""

BASELINES: dict[str, NewOptimiser] = {
    "pso": Pso,
    "ipso": Ipso,
    "gapso": Gapso,
    "ca": BrainStorm,
    "aca": AntColony,
}
"""What the paper compares its E-CPSO with."""
COMPARED: dict[str, NewOptimiser] = {"ecpso": AdaptiveSwarm} | BASELINES
"""All six in one frame: E-CPSO, too, as a swarm alone."""
