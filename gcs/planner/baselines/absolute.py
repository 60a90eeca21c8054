"""The paper's representation: one position holds the coordinates of all vehicles' control points, and starts at random.

The paper says so in words alone (section 3.1.2: "track points" of all UAVs are the solution); that coordinates are
absolute and drawn from all of the flight range is the plain reading of a traditional swarm. Control points are those of
the same cubic B-splines as everywhere else.
"""

import numpy as np

from gcs.planner.baselines.optimiser import Array, Lattice, SearchSpace
from gcs.planner.fleet_cost import Problem, plan_costs
from gcs.planner.representation import abscissae

NODES = 21
"""Of the ants' lattice, across the flight range in either direction."""


class Joint:
    """One optimiser moves all vehicles at once.

    Args:
        problem: what is planned.
        box_m: (2, 3) lowest and highest corner, ENU, of what positions may reach.
    """

    def __init__(self, problem: Problem, box_m: Array) -> None:
        self._problem = problem
        self._middle_m, self._half_m = box_m.mean(axis=0), 0.5 * (box_m[1] - box_m[0])
        self.start_m, self.target_m = problem.base_m[:, 0], problem.base_m[:, -1]

    def space(self) -> SearchSpace:
        """Random positions, and a lattice of planes across the way."""
        n_vehicles, n_control = self._problem.base_m.shape[:2]
        dimensions = n_vehicles * (n_control - 2) * 3

        def fresh(rng: np.random.Generator, count: int) -> Array:
            return rng.uniform(-1.0, 1.0, (count, dimensions))

        return SearchSpace(np.empty((0, dimensions)), fresh, self._lattice())

    def controls(self, positions: Array) -> Array:
        """(plans, vehicles, n, 3) control points, ENU [m], of (plans, d) positions."""
        n_vehicles, n_control = self._problem.base_m.shape[:2]
        inner = self._middle_m + self._half_m * positions.reshape(-1, n_vehicles, n_control - 2, 3)
        starts = np.broadcast_to(self.start_m[:, None], (*inner.shape[:2], 1, 3))
        targets = np.broadcast_to(self.target_m[:, None], (*inner.shape[:2], 1, 3))
        return self._pinned(np.concatenate((starts, inner, targets), axis=2))

    def costs(self, positions: Array) -> tuple[Array, Array]:
        """(plans,) eq. 13 and (plans,) sums of squared violations."""
        objective, violation = np.empty(len(positions)), np.empty(len(positions))
        plan_costs(self._problem, self.controls(positions), objective, violation)
        return objective, violation

    def _pinned(self, controls_m: Array) -> Array:
        """The same, with those control points moved that make curves pass the targets on their ways."""
        problem, weights = self._problem, self._problem.pin_weights
        for vehicle, stop in zip(*np.nonzero(problem.pins), strict=True):
            c, own = problem.pins[vehicle, stop], controls_m[:, vehicle]
            beside = weights[c, 0] * own[:, c - 1] + weights[c, 2] * own[:, c + 1]
            own[:, c] = (problem.zones_m[vehicle, 1 + stop] - beside) / weights[c, 1]
        return controls_m

    def _lattice(self) -> Lattice:
        """For each vehicle and control point a plane across the axis, east or north, along which it goes farther."""
        along = abscissae(self._problem.base_m.shape[1])[1:-1]
        places_m = np.array([self._planes(*ends, along) for ends in zip(self.start_m, self.target_m, strict=True)])
        values = (places_m - self._middle_m) / self._half_m
        return Lattice(self.start_m, self.target_m, places_m, values)

    def _planes(self, start_m: Array, target_m: Array, along: Array) -> Array:
        """(layers, side, side, 3) nodes."""
        way_m = target_m - start_m
        axis = int(np.argmax(np.abs(way_m[:2])))
        steps = np.linspace(-1.0, 1.0, NODES)
        across_m = (self._middle_m + steps[:, None] * self._half_m)[:, [1 - axis, 2]]
        nodes = np.empty((len(along), NODES, NODES, 3))
        nodes[..., axis] = (start_m[axis] + along * way_m[axis])[:, None, None]
        nodes[..., 1 - axis] = across_m[:, 0, None]
        nodes[..., 2] = across_m[:, 1]
        return nodes
