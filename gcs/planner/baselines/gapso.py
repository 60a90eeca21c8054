"""GAPSO: a particle swarm with the crossover and mutation of a genetic algorithm.

M. Lovbjerg, T. Rasmussen, T. Krink: Hybrid particle swarm optimiser with breeding and subpopulations. Proc. Genetic
and Evolutionary Computation Conf., 2001, 469-476 (breeding: arithmetic crossover of positions, and of directions).
N. Higashi, H. Iba: Particle swarm optimization with Gaussian mutation. Proc. IEEE Swarm Intelligence Symposium, 2003,
72-79.

Probabilities are those of the paper's section 3.1.1. A particle that mutates is changed in one dimension.
"""

import numpy as np

from gcs.planner.baselines.optimiser import SEARCH_RANGE, Array
from gcs.planner.baselines.pso import Pso

CROSSOVER = 0.3
"""Probability that a particle is bred."""
MUTATION = 0.1
"""Probability that a particle mutates."""
MUTATION_SHARE = 0.1
"""Standard deviation of a mutation, as a share of the search range."""


class Gapso(Pso):
    """The traditional swarm, bred and mutated after each flight."""

    def ask(self, share_done: float) -> Array:
        """(n, d) the first positions, then those after flight, crossover and mutation."""
        flies = self._asked
        super().ask(share_done)
        if flies:
            self._breed()
            self._mutate()
        return self.position

    def _breed(self) -> None:
        """Replace pairs of particles by their children (Lovbjerg et al., eqs. 3 to 6)."""
        chosen = self._rng.permutation(np.flatnonzero(self._rng.random(len(self.position)) < CROSSOVER))
        one, other = np.array_split(chosen[: len(chosen) // 2 * 2], 2)
        share = self._rng.random((len(one), self.position.shape[1]))
        mother, father = self.position[one], self.position[other]
        self.position[one] = share * mother + (1.0 - share) * father
        self.position[other] = share * father + (1.0 - share) * mother
        course = self.velocity[one] + self.velocity[other]
        course /= np.maximum(np.linalg.norm(course, axis=1, keepdims=True), 1e-12)
        for parent in (one, other):
            self.velocity[parent] = course * np.linalg.norm(self.velocity[parent], axis=1, keepdims=True)

    def _mutate(self) -> None:
        chosen = np.flatnonzero(self._rng.random(len(self.position)) < MUTATION)
        where = self._rng.integers(0, self.position.shape[1], len(chosen))
        self.position[chosen, where] += self._rng.normal(0.0, MUTATION_SHARE * SEARCH_RANGE, len(chosen))
        np.clip(self.position, -1.0, 1.0, out=self.position)
