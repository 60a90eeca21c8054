"""One small swarm per vehicle, searching in turn: each against the present curves of all others."""

import functools

import numpy as np
import numpy.typing as npt

from gcs.planner.curve_cost import sampling
from gcs.planner.ecpso import Ecpso, EcpsoSettings
from gcs.planner.fleet_cost import Context, Problem, no_others, set_context, swarm_cost
from gcs.planner.lone_descent import alone, descend_alone
from gcs.planner.refinement import stricter
from gcs.planner.representation import bows, fresh_bows

Array = npt.NDArray[np.float64]

LONE_STRICTNESS = 10.0
"""Factor on the weight of violations in descents of single vehicles."""
LONE_STARTS = 3
"""First particles that are tried, where descents from the better ones do not lead to a flyable curve."""
RANKING_SAMPLES = 32
"""Of the first particles, where these only have to be put in order: half of what the descents look at."""
SWEEPS = 2
"""How often every vehicle chooses among the first particles before the search begins."""


class Cooperation:
    """The swarms of a fleet, and the plan that they improve together.

    Args:
        problem: what is planned.
        settings: of every swarm.
        rng: all randomness; every swarm gets a generator spawned from it.
        bent: first and fresh particles are bows; else there are the straight line and uniformly random ones.
    """

    def __init__(self, problem: Problem, settings: EcpsoSettings, rng: np.random.Generator, bent: bool = True) -> None:
        self.problem, self._settings, self._rng, self._bent = problem, settings, rng, bent
        n_vehicles, n_control = problem.base_m.shape[:2]
        self.offsets = np.zeros((n_vehicles, 2 * (n_control - 2)))
        self.curve_evaluations = 0
        self._first = bows(n_control) if bent else np.zeros((1, self.offsets.shape[1]))
        self._context: Context | None = None

    @functools.cached_property
    def _swarms(self) -> list[Ecpso]:
        """One per vehicle; they come into being when they are first needed, which first plans often go without."""
        n_vehicles, n_control = self.problem.base_m.shape[:2]

        def fresh(generator: np.random.Generator, count: int) -> Array:
            if not self._bent:
                return generator.uniform(-1.0, 1.0, (count, self.offsets.shape[1]))
            return fresh_bows(generator, count, n_control)

        return [Ecpso(self._first, fresh, self._settings, generator) for generator in self._rng.spawn(n_vehicles)]

    def start(self) -> None:
        """Give every vehicle the best of the first particles, in turn, until the choices fit one another."""
        for _ in range(SWEEPS):
            for vehicle in range(len(self.offsets)):
                costs = self._costs(vehicle, self._first)
                self._enter(vehicle, self._first[int(np.argmin(costs))])

    def fly_alone(self, most: int, enough: float) -> Array:
        """Give every vehicle the curve that is best without the others: the best first particle, and a descent from it.

        Args:
            most: evaluations of each descent.
            enough: sum of squared violations with which no other first particle is tried.

        Returns:
            (vehicles,) sums of squared violations.
        """
        found = [self._best_alone(vehicle, most, enough) for vehicle in range(len(self.offsets))]
        self._context = None
        return np.array(found)

    def _best_alone(self, vehicle: int, most: int, enough: float) -> float:
        """Set one vehicle's offsets, and return the violation that is left."""
        strict = alone(stricter(self.problem, LONE_STRICTNESS), vehicle)
        coarse = self.problem._replace(samples=sampling(self.problem.base_m.shape[1], RANKING_SAMPLES))
        order = np.argsort(self._costs(vehicle, self._first, no_others(), coarse), kind="stable")
        least = np.inf
        for start in order[:LONE_STARTS]:
            offsets, cost, violation = self._first[start : start + 1].copy(), np.empty(1), np.empty(1)
            self.curve_evaluations += descend_alone(strict, offsets, most)
            swarm_cost(strict, 0, offsets, no_others(), cost, violation)
            if violation[0] < least:
                self.offsets[vehicle], least = offsets[0], float(violation[0])
            if least < enough:
                break
        return least

    @property
    def curves_per_round(self) -> int:
        """Evaluations of single curves that the next round takes."""
        return sum(1 + (1 + self._settings.window) * len(swarm.memory) for swarm in self._swarms)

    def round(self) -> None:
        """Let every swarm search for one window of iterations, and take over what is better than the present plan."""
        for vehicle, swarm in enumerate(self._swarms):
            present = float(self._costs(vehicle, self.offsets[vehicle : vehicle + 1])[0])
            swarm.remember(self._costs(vehicle, swarm.memory))
            swarm.offer(self.offsets[vehicle], present)
            for _ in range(self._settings.window):
                swarm.tell(self._costs(vehicle, swarm.ask()))
            position, cost = swarm.best()
            if cost < present:
                self._enter(vehicle, position)

    def again(self, problem: Problem) -> "Cooperation":
        """New swarms for other variables; what was spent so far still counts."""
        afresh = Cooperation(problem, self._settings, self._rng, self._bent)
        afresh.curve_evaluations = self.curve_evaluations
        return afresh

    def violations_alone(self, offsets: Array) -> Array:
        """(vehicles,) sums of squared violations of a plan, (vehicles, d), without those between vehicles."""
        objective, violation = np.empty(len(offsets)), np.empty(len(offsets))
        for vehicle in range(len(offsets)):
            row = slice(vehicle, vehicle + 1)
            swarm_cost(self.problem, vehicle, offsets[row], no_others(), objective[row], violation[row])
        return violation

    def pose(self, problem: Problem) -> None:
        """Go on with the same variables, but other limits."""
        self.problem = problem
        self._context = None

    def adopt(self, offsets: Array) -> None:
        """Take over a whole plan, (vehicles, d)."""
        self.offsets = offsets.copy()
        self._context = None

    def _others(self) -> Context:
        """Where all vehicles are on their present curves; worked out when it is asked for."""
        if self._context is None:
            self._context = no_others(len(self.offsets), len(self.problem.coupling.first))
            for vehicle, offsets in enumerate(self.offsets):
                set_context(self.problem, vehicle, offsets, self._context)
        return self._context

    def _enter(self, vehicle: int, offsets: Array) -> None:
        self.offsets[vehicle] = offsets
        set_context(self.problem, vehicle, offsets, self._others())

    def _costs(
        self, vehicle: int, positions: Array, context: Context | None = None, problem: Problem | None = None
    ) -> Array:
        objective, violation = np.empty(len(positions)), np.empty(len(positions))
        swarm_cost(problem or self.problem, vehicle, positions, context or self._others(), objective, violation)
        self.curve_evaluations += len(positions)
        return objective + self.problem.terms.penalty_weight * violation
