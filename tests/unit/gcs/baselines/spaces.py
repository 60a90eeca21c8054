"""A plain search space and the Ackley function, for tests of algorithms by themselves."""

import numpy as np

from gcs.planner.baselines.optimiser import Array, Lattice, SearchSpace

OPTIMUM = np.array([0.3, -0.45])
NODES = 41


def ackley(positions: Array) -> Array:
    """(n,) values at (n, 2) positions in [-1, 1], which stand for [-32, 32], with the minimum of 0 at `OPTIMUM`."""
    x = 32.0 * (positions - OPTIMUM)
    bowl = -20.0 * np.exp(-0.2 * np.sqrt(np.mean(x**2, axis=1)))
    return bowl - np.exp(np.mean(np.cos(2.0 * np.pi * x), axis=1)) + 20.0 + np.e


def plane() -> SearchSpace:
    """[-1, 1]^2, with a lattice of one layer whose nodes are all as far from everything: no heuristic helps."""

    def fresh(rng: np.random.Generator, count: int) -> Array:
        return rng.uniform(-1.0, 1.0, (count, 2))

    steps = np.linspace(-1.0, 1.0, NODES)
    values = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1)[None, None]
    nowhere = np.zeros((1, 3))
    return SearchSpace(np.empty((0, 2)), fresh, Lattice(nowhere, nowhere, np.zeros((1, 1, NODES, NODES, 3)), values))
