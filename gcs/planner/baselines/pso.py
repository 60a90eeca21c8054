"""PSO: the traditional particle swarm, with an inertia weight and a greatest speed.

J. Kennedy, R. Eberhart: Particle swarm optimization. Proc. IEEE Int. Conf. on Neural Networks, 1995, 1942-1948.
Y. Shi, R. Eberhart: A modified particle swarm optimizer. Proc. IEEE Int. Conf. on Evolutionary Computation, 1998,
69-73.

Parameters are those of the paper's section 3.1.1; its greatest speed of 2 is read as percent of the search range.
"""

from dataclasses import dataclass

import numpy as np

from gcs.planner.baselines.optimiser import SEARCH_RANGE, Array, SearchSpace


@dataclass(frozen=True)
class Pull:
    """What drives the particles of one iteration; the speed is a share of the search range per iteration."""

    inertia: float = 0.6
    own_learning: float = 2.0
    social_learning: float = 2.0
    speed: float = 0.02


class Pso:
    """A swarm of `population` particles, all of which learn from the best of all (global topology)."""

    def __init__(self, space: SearchSpace, population: int, rng: np.random.Generator) -> None:
        self._rng = rng
        self.position = space.beginning(rng, population)
        greatest = self.pull(0.0).speed * SEARCH_RANGE
        self.velocity = rng.uniform(-greatest, greatest, self.position.shape)
        self._memory, self._memory_cost = self.position.copy(), np.full(population, np.inf)
        self._asked = False

    def pull(self, share_done: float) -> Pull:
        """Constant, in the traditional swarm."""
        return Pull()

    @property
    def memory(self) -> Array:
        """(n, d) the best position of each particle."""
        return self._memory

    def ask(self, share_done: float) -> Array:
        """(n, d) the first positions, then those after equations 7 and 8."""
        if self._asked:
            self._fly(self.pull(share_done))
        self._asked = True
        return self.position

    def tell(self, costs: Array) -> None:
        """Take the (n,) costs of the positions asked for."""
        better = costs < self._memory_cost
        self._memory[better], self._memory_cost[better] = self.position[better], costs[better]

    def remember(self, costs: Array) -> None:
        """Take new (n,) costs of the `memory`."""
        self._memory_cost[:] = costs

    def best(self) -> tuple[Array, float]:
        """The best position so far, (d,), and its cost."""
        index = int(np.argmin(self._memory_cost))
        return self._memory[index].copy(), float(self._memory_cost[index])

    def _fly(self, pull: Pull) -> None:
        shape = self.position.shape
        own = pull.own_learning * self._rng.random(shape) * (self._memory - self.position)
        social = pull.social_learning * self._rng.random(shape) * (self.best()[0] - self.position)
        greatest = pull.speed * SEARCH_RANGE
        self.velocity = np.clip(pull.inertia * self.velocity + own + social, -greatest, greatest)  # (eq. 7)
        moved = self.position + self.velocity  # (eq. 8)
        self.position = np.clip(moved, -1.0, 1.0)
        self.velocity[moved != self.position] = 0.0
