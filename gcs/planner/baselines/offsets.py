"""Our representation: offsets from the straight line, one optimiser per vehicle, each against the others' curves.

As `gcs.planner.cooperation` does it, for any algorithm, and without gradient polish and guide paths.
"""

import numpy as np

from gcs.planner.baselines.optimiser import Array, Lattice, SearchSpace
from gcs.planner.fleet_cost import Problem, no_others, set_context, swarm_cost
from gcs.planner.representation import bows, fresh_bows

NODES = 41
"""Of the ants' lattice, sideways and upwards; an odd number, so that the straight line is among them."""


class OneVehicle:
    """The space of one vehicle's curves, and their costs beside those of the others.

    Args:
        problem: what is planned.
        vehicle: its index.
    """

    def __init__(self, problem: Problem, vehicle: int) -> None:
        self._problem, self._vehicle = problem, vehicle

    def space(self) -> SearchSpace:
        """Bows to begin with, and a lattice of offsets."""
        n_control = self._problem.base_m.shape[1]

        def fresh(rng: np.random.Generator, count: int) -> Array:
            return fresh_bows(rng, count, n_control)

        return SearchSpace(bows(n_control), fresh, self._lattice())

    def _lattice(self) -> Lattice:
        base_m, axes_m = self._problem.base_m[self._vehicle], self._problem.axes_m[self._vehicle]
        steps = np.linspace(-1.0, 1.0, NODES)
        offsets = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1)
        places_m = base_m[1:-1, None, None] + np.einsum("ijo,loa->lija", offsets, axes_m)
        values = np.broadcast_to(offsets, (*places_m.shape[:3], 2))
        return Lattice(base_m[None, 0], base_m[None, -1], places_m[None], values[None])


class Fleet:
    """The present plan, and what changing one vehicle's curve costs.

    Args:
        problem: what is planned.
        weight: of the sum of squared violations.
    """

    def __init__(self, problem: Problem, weight: float) -> None:
        self._problem, self._weight = problem, weight
        n_vehicles, n_control = problem.base_m.shape[:2]
        self.offsets = np.zeros((n_vehicles, 2 * (n_control - 2)))
        self._context = no_others(n_vehicles, len(problem.coupling.first))
        for vehicle in range(n_vehicles):
            self.enter(vehicle, self.offsets[vehicle])

    def enter(self, vehicle: int, offsets: Array) -> None:
        """Let a vehicle fly (d,) other offsets."""
        self.offsets[vehicle] = offsets
        set_context(self._problem, vehicle, offsets, self._context)

    def costs(self, vehicle: int, positions: Array) -> Array:
        """(n,) penalised costs of (n, d) offsets of one vehicle."""
        objective, violation = np.empty(len(positions)), np.empty(len(positions))
        swarm_cost(self._problem, vehicle, positions, self._context, objective, violation)
        return objective + self._weight * violation
