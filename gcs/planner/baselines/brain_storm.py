"""CA: the clustering-based algorithm, read as brain storm optimisation.

Y. Shi: Brain storm optimization algorithm. Advances in Swarm Intelligence (ICSI), LNCS 6728, 2011, 303-309.

Ideas are clustered (k-means); a new idea is made from one of one cluster, or from two of two clusters, by adding noise
that gets smaller with time, and takes the place of its predecessor if it is better. The paper gives k = 8 clusters and
a selection probability of 0.7, which is taken for that of one cluster; the rest is Shi's. Shi's noise is up to one unit
in a range of 200; here the greatest is that of the other algorithms' steps, 2 % of the range.
"""

import numpy as np
import numpy.typing as npt

from gcs.planner.baselines.optimiser import SEARCH_RANGE, Array, SearchSpace

IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

CLUSTERS = 8
ONE_CLUSTER = 0.7
"""Probability that an idea is made from one cluster and not from two."""
CENTRE_OF_ONE = 0.4
"""Probability that the best idea of the one cluster is taken, and not any of it."""
CENTRES_OF_TWO = 0.5
REPLACED_CENTRE = 0.2
"""Probability that the centre of one cluster is replaced by a fresh idea."""
GREATEST_STEP = 0.02 * SEARCH_RANGE
STEEPNESS = 10.0
"""Of the logistic curve along which noise falls: Shi's slope of 20 in 200 iterations."""
SWEEPS = 5
"""Of k-means, per iteration."""


class BrainStorm:
    """A group of `population` ideas."""

    def __init__(self, space: SearchSpace, population: int, rng: np.random.Generator) -> None:
        self._rng, self._fresh = rng, space.fresh
        self._ideas = space.beginning(rng, population)
        self._costs = np.full(population, np.inf)
        self._proposed = self._ideas
        self._asked = False

    @property
    def memory(self) -> Array:
        """(n, d) the ideas."""
        return self._ideas

    def ask(self, share_done: float) -> Array:
        """(n, d) the first ideas, then a new one for each."""
        if self._asked:
            self._proposed = self._new_ideas(share_done)
        self._asked = True
        return self._proposed

    def tell(self, costs: Array) -> None:
        """Take the (n,) costs of the ideas asked for."""
        better = costs < self._costs
        self._ideas[better], self._costs[better] = self._proposed[better], costs[better]

    def remember(self, costs: Array) -> None:
        """Take new (n,) costs of the `memory`."""
        self._costs[:] = costs

    def best(self) -> tuple[Array, float]:
        """The best idea so far, (d,), and its cost."""
        index = int(np.argmin(self._costs))
        return self._ideas[index].copy(), float(self._costs[index])

    def _new_ideas(self, share_done: float) -> Array:
        label = clustered(self._ideas, min(CLUSTERS, len(self._ideas)), self._rng)
        centres = self._centres(label)
        n = len(self._ideas)
        from_one = self._drawn(label, centres, self._rng.random(n) < CENTRE_OF_ONE)
        takes_centres = self._rng.random(n) < CENTRES_OF_TWO
        share = self._rng.random((n, 1))
        from_two = share * self._drawn(label, centres, takes_centres)
        from_two += (1.0 - share) * self._drawn(label, centres, takes_centres)
        base = np.where(self._rng.random((n, 1)) < ONE_CLUSTER, from_one, from_two)
        step = GREATEST_STEP * self._rng.random((n, 1)) / (1.0 + np.exp(-STEEPNESS * (0.5 - share_done)))
        return np.clip(base + step * self._rng.standard_normal(base.shape), -1.0, 1.0)

    def _centres(self, label: IntArray) -> Array:
        """(k, d) the best idea of each cluster, one of them sometimes replaced by a fresh one."""
        order = np.argsort(self._costs, kind="stable")
        k = int(label.max()) + 1
        best = np.zeros(k, np.int64)
        best[label[order[::-1]]] = order[::-1]  # the last to be written is the best of its cluster
        centres = self._ideas[best]
        if self._rng.random() < REPLACED_CENTRE:
            centres[self._rng.integers(k)] = self._fresh(self._rng, 1)[0]
        return centres

    def _drawn(self, label: IntArray, centres: Array, takes_centre: BoolArray) -> Array:
        """(n, d) ideas of clusters drawn in proportion to their sizes: the cluster's best, or any of it."""
        drawn = self._rng.integers(0, len(self._ideas), len(self._ideas))
        return np.where(takes_centre[:, None], centres[label[drawn]], self._ideas[drawn])


def clustered(points: Array, k: int, rng: np.random.Generator) -> IntArray:
    """(n,) cluster of each of (n, d) points: a few sweeps of k-means (Lloyd) from k of the points."""
    centres = points[rng.choice(len(points), k, replace=False)].copy()
    label = np.zeros(len(points), np.int64)
    for _ in range(SWEEPS):
        apart = (centres**2).sum(axis=1) - 2.0 * points @ centres.T
        label = np.argmin(apart, axis=1)
        for index in np.unique(label):
            centres[index] = points[label == index].mean(axis=0)
    return np.unique(label, return_inverse=True)[1]
