"""What all compared algorithms have in common: they are asked for positions and told what these cost."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

Fresh = Callable[[np.random.Generator, int], Array]
"""Draws (n, d) positions."""

SEARCH_RANGE = 2.0
"""Positions are in [-1, 1] per dimension."""


@dataclass(frozen=True)
class Lattice:
    """The nodes that ants walk on: one walk per vehicle, layer by layer from its start to its target.

    Args:
        start_m: (walks, 3) where walks begin, ENU.
        target_m: (walks, 3) where they end.
        places_m: (walks, layers, side, side, 3) where the nodes are.
        values: (walks, layers, side, side, v) the variables that a node stands for; a position is made of those of
            its nodes, walk by walk and layer by layer.
    """

    start_m: Array
    target_m: Array
    places_m: Array
    values: Array


@dataclass(frozen=True)
class SearchSpace:
    """What an algorithm is told of the space that it searches.

    Args:
        first: (m, d) positions to begin with, the most promising first; may be none.
        fresh: draws further ones.
        lattice: for algorithms that walk from node to node.
    """

    first: Array
    fresh: Fresh
    lattice: Lattice

    def beginning(self, rng: np.random.Generator, count: int) -> Array:
        """(count, d) positions to begin with."""
        missing = count - len(self.first)
        return self.first[:count].copy() if missing <= 0 else np.concatenate((self.first, self.fresh(rng, missing)))


class Optimiser(Protocol):
    """An algorithm that minimises, sans-IO: whoever asks evaluates."""

    @property
    def memory(self) -> Array:
        """(n, d) the positions whose costs it keeps."""
        ...

    def ask(self, share_done: float) -> Array:
        """(n, d) positions whose costs are to be told next.

        Args:
            share_done: of the search, 0 to 1, for algorithms that go by it.
        """
        ...

    def tell(self, costs: Array) -> None:
        """Take the (n,) costs of the positions asked for."""
        ...

    def remember(self, costs: Array) -> None:
        """Take new (n,) costs of the `memory`, when what costs depend on has changed."""
        ...

    def best(self) -> tuple[Array, float]:
        """The best position so far, (d,), and its cost."""
        ...
