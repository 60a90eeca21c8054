"""E-CPSO as one of the compared algorithms: the paper's swarm, and nothing of what the shipped planner adds to it."""

import numpy as np

from gcs.planner.baselines.optimiser import Array, SearchSpace
from gcs.planner.ecpso import Ecpso, EcpsoSettings

LEAST_SHARE = 3
"""The population never gets smaller than this part of its first size."""


class AdaptiveSwarm:
    """`gcs.planner.ecpso` with so many particles."""

    def __init__(
        self,
        space: SearchSpace,
        population: int,
        rng: np.random.Generator,
        settings: EcpsoSettings | None = None,
    ) -> None:
        chosen = settings or paper_settings(population)
        self._swarm = Ecpso(space.first, space.fresh, chosen, rng)

    @property
    def memory(self) -> Array:
        """(n, d) the best position of each particle."""
        return self._swarm.memory

    def ask(self, share_done: float) -> Array:
        """(n, d) positions whose costs are to be told next."""
        return self._swarm.ask()

    def tell(self, costs: Array) -> None:
        """Take the (n,) costs of the positions asked for."""
        self._swarm.tell(costs)

    def remember(self, costs: Array) -> None:
        """Take new (n,) costs of the `memory`."""
        self._swarm.remember(costs)

    def best(self) -> tuple[Array, float]:
        """The best position so far, (d,), and its cost."""
        return self._swarm.best()


def paper_settings(population: int) -> EcpsoSettings:
    """The paper's parameters with another population."""
    return EcpsoSettings(population=population, least_population=max(population // LEAST_SHARE, 1))
