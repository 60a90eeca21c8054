"""The two ways in which an algorithm searches for a plan of a whole fleet, step by step."""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np

from gcs.planner.baselines.absolute import Joint
from gcs.planner.baselines.algorithms import NewOptimiser
from gcs.planner.baselines.offsets import Fleet, OneVehicle
from gcs.planner.baselines.optimiser import Array, Optimiser
from gcs.planner.ecpso import EcpsoSettings
from gcs.planner.fleet_cost import Problem, all_control_points, plan_costs

WINDOW = EcpsoSettings().window
"""Iterations that one vehicle searches before it is the next one's turn."""
SWEEPS = 2
"""How often every vehicle chooses among the first positions before the search begins."""


class Representation(Enum):
    """How a plan is written as numbers, and with it how the search begins and goes on."""

    ABSOLUTE = "absolute"
    """The paper's: coordinates of all vehicles in one position, 300 particles, random start."""
    OFFSETS = "offsets"
    """Ours: offsets from the straight line, 24 particles per vehicle, in turn, starting from bows."""

    @property
    def population(self) -> int:
        """The paper's N_s, or that of the shipped planner per vehicle."""
        return 300 if self is Representation.ABSOLUTE else EcpsoSettings().population


@dataclass(frozen=True)
class Valued:
    """A plan with its costs as the search sees them.

    Args:
        controls_m: (vehicles, n, 3) control points, ENU.
        objective: eq. 13.
        violation: sum of the squared violations.
    """

    controls_m: Array
    objective: float
    violation: float


class Searcher(Protocol):
    """A search for a whole plan.

    Args:
        iterations: so far.
        best: the best plan so far.
    """

    iterations: int
    best: Valued

    @property
    def evaluations(self) -> float:
        """Of whole plans so far; one vehicle's curve counts as the fleet's share of one."""
        ...

    @property
    def next_evaluations(self) -> float:
        """What the next step will take."""
        ...

    def step(self, share_done: float) -> None:
        """Search on, when so much of the whole search is done (0 to 1)."""
        ...


class JointSearch:
    """One optimiser for all vehicles together: a step is one iteration.

    Args:
        problem: what is planned.
        box_m: (2, 3) corners of the flight range.
        new_optimiser: the algorithm.
        population: of it.
        weight: of the sum of squared violations.
        rng: all randomness.
    """

    def __init__(
        self,
        problem: Problem,
        box_m: Array,
        new_optimiser: NewOptimiser,
        population: int,
        weight: float,
        rng: np.random.Generator,
    ) -> None:
        self._joint, self._weight, self._population = Joint(problem, box_m), weight, population
        self._optimiser = new_optimiser(self._joint.space(), population, rng)
        self._plans = self.iterations = 0
        self.step(0.0)

    @property
    def evaluations(self) -> float:
        """Of whole plans so far."""
        return self._plans

    @property
    def next_evaluations(self) -> float:
        """Of the next iteration, at most."""
        return self._population

    def step(self, share_done: float) -> None:
        """One iteration."""
        positions = self._optimiser.ask(share_done)
        objective, violation = self._joint.costs(positions)
        costs = objective + self._weight * violation
        self._optimiser.tell(costs)
        self._plans += len(positions)
        self.iterations += 1
        index = int(np.argmin(costs))
        if self.iterations == 1 or costs[index] < self.best.objective + self._weight * self.best.violation:
            controls_m = self._joint.controls(positions[index : index + 1])[0]
            self.best = Valued(controls_m, float(objective[index]), float(violation[index]))


class InTurn:
    """One optimiser per vehicle: in a step each searches for one window of iterations, against the others' curves.

    Args:
        problem: what is planned.
        new_optimiser: the algorithm.
        population: per vehicle.
        weight: of the sum of squared violations.
        rng: all randomness; every optimiser gets a generator spawned from it.
    """

    def __init__(
        self, problem: Problem, new_optimiser: NewOptimiser, population: int, weight: float, rng: np.random.Generator
    ) -> None:
        self._problem, self._weight = problem, weight
        self._fleet, self._curves, self._plans = Fleet(problem, weight), 0, 0
        spaces = [OneVehicle(problem, vehicle).space() for vehicle in range(len(problem.base_m))]
        generators = rng.spawn(len(spaces))
        self._optimisers: list[Optimiser] = [
            new_optimiser(*parts) for parts in zip(spaces, [population] * len(spaces), generators, strict=True)
        ]
        self._population, self.iterations = population, 0
        for _ in range(SWEEPS):
            for vehicle, space in enumerate(spaces):
                costs = self._costs(vehicle, space.first)
                self._fleet.enter(vehicle, space.first[int(np.argmin(costs))])
        self.best = self._valued()

    @property
    def evaluations(self) -> float:
        """Of whole plans; one vehicle's curve counts as the fleet's share of one."""
        return self._plans + self._curves / len(self._optimisers)

    @property
    def next_evaluations(self) -> float:
        """Of the next step, at most."""
        return 2.0 + (WINDOW + 1) * self._population

    def step(self, share_done: float) -> None:
        """One window of iterations for every vehicle."""
        for vehicle, optimiser in enumerate(self._optimisers):
            self._search(vehicle, optimiser, share_done)
        self.iterations += WINDOW
        self.best = self._valued()

    def _search(self, vehicle: int, optimiser: Optimiser, share_done: float) -> None:
        present = float(self._costs(vehicle, self._fleet.offsets[vehicle : vehicle + 1])[0])
        optimiser.remember(self._costs(vehicle, optimiser.memory))  # the others have moved
        for _ in range(WINDOW):
            optimiser.tell(self._costs(vehicle, optimiser.ask(share_done)))
        position, cost = optimiser.best()
        if cost < present:
            self._fleet.enter(vehicle, position)

    def _costs(self, vehicle: int, positions: Array) -> Array:
        self._curves += len(positions)
        return self._fleet.costs(vehicle, positions)

    def _valued(self) -> Valued:
        self._plans += 1
        controls_m = all_control_points(self._problem, self._fleet.offsets)
        objective, violation = np.empty(1), np.empty(1)
        plan_costs(self._problem, controls_m[None], objective, violation)
        return Valued(controls_m, float(objective[0]), float(violation[0]))
