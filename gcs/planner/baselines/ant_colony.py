"""ACA: ants that walk from layer to layer of a lattice, and leave pheromone on its nodes.

M. Dorigo, V. Maniezzo, A. Colorni: Ant system: optimization by a colony of cooperating agents. IEEE Trans. Systems,
Man, and Cybernetics B 26(1), 1996, 29-41 (the rule of transition, elitist ants).
B. Bullnheimer, R. Hartl, C. Strauss: A new rank based version of the ant system. Central European J. for Operations
Research and Economics 7(1), 1999, 25-38 (who leaves how much; costs here have no natural zero).
T. Stuetzle, H. Hoos: MAX-MIN ant system. Future Generation Computer Systems 16(8), 2000, 889-914 (a least trail).

As usual in route planning, space is cut into layers across the way, an ant chooses among the nodes of the next layer
that are near its own, and is drawn to those that make little detour. Parameters are those of the paper's section 3.1.1.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gcs.planner.baselines.optimiser import Array, SearchSpace
from missions.kernels import compiled

IntArray = npt.NDArray[np.int64]

TRAIL_WEIGHT = 1.0
"""alpha, the pheromone's weight."""
HEURISTIC_WEIGHT = 7.0
"""gamma, that of the detour."""
EVAPORATION = 0.3
"""mu_1."""
ENHANCEMENT = 1.0
"""mu_2, what the best ant leaves."""
RANKED = 6
"""So many of the best ants of an iteration leave pheromone, too, the less the worse they are."""
LEAST_TRAIL = 0.01
FIRST_TRAIL = 1.0
WINDOW = 3
"""From one layer to the next an ant moves at most so many nodes to either side."""
TINY_M = 1e-9
"""Keeps shares of distances defined for ants that are at their target."""


class Nodes(NamedTuple):
    """One layer of one walk."""

    places_m: Array
    """(side, side, 3)."""
    ahead_m: Array
    """(side, side) distances to the target."""
    trail: Array
    """(side, side) pheromone."""


class AntColony:
    """A colony of `population` ants."""

    def __init__(self, space: SearchSpace, population: int, rng: np.random.Generator) -> None:
        self._rng, self._population, self._lattice = rng, population, space.lattice
        self._walks, self._layers, self._side = space.lattice.places_m.shape[:3]
        self._trail = np.full((self._walks, self._layers, self._side, self._side), FIRST_TRAIL)
        target_m = space.lattice.target_m[:, None, None, None]
        self._ahead_m = np.linalg.norm(space.lattice.places_m - target_m, axis=-1)
        self._nodes = np.empty((0, self._walks, self._layers, 2), np.int64)
        self._best_nodes, self._best_cost = self._nodes, np.inf

    @property
    def memory(self) -> Array:
        """(0 or 1, d) the best position so far."""
        return self._positions(self._best_nodes)

    def ask(self, share_done: float) -> Array:
        """(n, d) positions of the ways that ants walk now."""
        self._nodes = np.empty((self._population, self._walks, self._layers, 2), np.int64)
        for walk in range(self._walks):
            node, place_m = self._beginning(walk)
            for layer in range(self._layers):
                node = self._next(walk, layer, node, place_m)
                self._nodes[:, walk, layer] = node
                place_m = self._lattice.places_m[walk, layer, node[:, 0], node[:, 1]]
        return self._positions(self._nodes)

    def tell(self, costs: Array) -> None:
        """Take the (n,) costs of the positions asked for: pheromone evaporates, and the best ants leave new one."""
        order = np.argsort(costs, kind="stable")
        if costs[order[0]] < self._best_cost:
            self._best_nodes, self._best_cost = self._nodes[order[:1]].copy(), float(costs[order[0]])
        self._trail *= 1.0 - EVAPORATION
        for rank, ant in enumerate(order[:RANKED]):
            self._leave(self._nodes[ant], ENHANCEMENT * (RANKED - rank) / (RANKED + 1))
        self._leave(self._best_nodes[0], ENHANCEMENT)
        np.maximum(self._trail, LEAST_TRAIL, out=self._trail)

    def remember(self, costs: Array) -> None:
        """Take new costs of the `memory`."""
        if len(costs):
            self._best_cost = float(costs[0])

    def best(self) -> tuple[Array, float]:
        """The best position so far, (d,), and its cost."""
        return self.memory[0], self._best_cost

    def _beginning(self, walk: int) -> tuple[IntArray, Array]:
        """(n, 2) the node of the first layer that is nearest to where the walk begins, and (n, 3) where it begins."""
        start_m = self._lattice.start_m[walk]
        away_m = np.linalg.norm(self._lattice.places_m[walk, 0] - start_m, axis=-1)
        node = np.array(np.unravel_index(int(np.argmin(away_m)), away_m.shape))
        return np.tile(node, (self._population, 1)), np.tile(start_m, (self._population, 1))

    def _next(self, walk: int, layer: int, node: IntArray, place_m: Array) -> IntArray:
        """(n, 2) nodes of a layer, chosen by ants at (n, 3) places near (n, 2) nodes of the layer before."""
        shortest_m = np.linalg.norm(self._lattice.target_m[walk] - place_m, axis=-1)
        nodes = Nodes(self._lattice.places_m[walk, layer], self._ahead_m[walk, layer], self._trail[walk, layer])
        chosen = np.empty_like(node)
        choose(nodes, node, place_m, shortest_m, self._rng.random(len(node)), chosen)
        return chosen

    def _leave(self, nodes: IntArray, amount: float) -> None:
        """Add pheromone to the (walks, layers, 2) nodes of one ant."""
        walk, layer = np.indices(nodes.shape[:2])
        self._trail[walk, layer, nodes[..., 0], nodes[..., 1]] += amount

    def _positions(self, nodes: IntArray) -> Array:
        walk, layer = np.indices(nodes.shape[1:3])
        values = self._lattice.values[walk, layer, nodes[..., 0], nodes[..., 1]]
        return values.reshape(len(nodes), values.shape[1] * values.shape[2] * values.shape[3])


@compiled
def choose(nodes: Nodes, before: IntArray, place_m: Array, shortest_m: Array, dice: Array, chosen: IntArray) -> None:
    """Let ants choose their next nodes, with probabilities in proportion to trail^alpha * directness^gamma.

    Directness is the distance to the target as a share of the way there by the node.

    Args:
        nodes: of the next layer.
        before: (n, 2) the ants' nodes in the layer before.
        place_m: (n, 3) where they are.
        shortest_m: (n,) how far from the target.
        dice: (n,) random numbers in [0, 1).
        chosen: (n, 2) is filled.
    """
    side, width = len(nodes.ahead_m), 2 * WINDOW + 1
    heaped = np.empty(width * width)
    for ant in range(len(before)):
        total = 0.0
        for k in range(width * width):
            i, j = before[ant, 0] + k // width - WINDOW, before[ant, 1] + k % width - WINDOW
            if 0 <= i < side and 0 <= j < side:
                leg = 0.0
                for axis in range(3):
                    leg += (nodes.places_m[i, j, axis] - place_m[ant, axis]) ** 2
                directness = (shortest_m[ant] + TINY_M) / (np.sqrt(leg) + nodes.ahead_m[i, j] + TINY_M)
                total += nodes.trail[i, j] ** TRAIL_WEIGHT * directness**HEURISTIC_WEIGHT
            heaped[k] = total
        k = np.searchsorted(heaped, float(dice[ant]) * total, "right")
        chosen[ant, 0], chosen[ant, 1] = before[ant, 0] + k // width - WINDOW, before[ant, 1] + k % width - WINDOW
