"""One replan: horizon, reference, seeds, one compiled search; shorter horizons when the long one fails."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from companion.planner.evaluation import HARD, LocalProblem, evaluate
from companion.planner.limits import FlightLimits, Surroundings, ends_of, free_space
from companion.planner.mopso import SearchPlan, chosen, new_swarm, search
from companion.planner.reference import WIDTH, Reference, Way, lay_reference
from companion.planner.spline_shape import SplineShape
from companion.settings import SearchSettings

Array = npt.NDArray[np.float64]

LADDER = (1.0, 0.6, 1.0 / 3.0)
"""Shares of the horizon that are tried one after the other."""
TIME_SCALES = (1.0, 1.06, 1.15, 1.35)
"""Time scales of the first particles."""
TIME_SPREAD = 0.05
"""Of the other particles' time scales."""


class Horizon(NamedTuple):
    """How far ahead plans reach."""

    length_m: float
    duration_s: float


@dataclass(frozen=True)
class LocalPlan:
    """What came out of a replan.

    Args:
        control_m: (n, 3) control points, ENU [m].
        knot_s: knot interval [s].
        value: (5,) of the trajectory: three objectives, hard and soft violations.
        goal_arc_m: where on the way it comes to rest.
    """

    control_m: Array
    knot_s: float
    value: Array
    goal_arc_m: float


@dataclass(frozen=True)
class LocalPlanner:
    """Plans within a horizon along a way.

    Args:
        limits: what is kept.
        around: what is avoided.
        horizon: how far plans reach.
        shape: the spline's constants.
        settings: of the search.
        weights: (3,) phi of the objectives.
    """

    limits: FlightLimits
    around: Surroundings
    horizon: Horizon
    shape: SplineShape
    settings: SearchSettings
    weights: Array

    def plan(self, way: Way, from_m: float, start: Array, warm: Way | None, rng: np.random.Generator) -> LocalPlan:
        """Plan from a state along a way, to rest on it at the end of the horizon.

        Args:
            way: the guide.
            from_m: arc [m] of the guide beside which the vehicle is.
            start: (3, 3) position, velocity, acceleration at the beginning of the plan, ENU.
            warm: the path of the committed trajectory and then the guide; its arc begins at the start.
            rng: the search's randomness.
        """
        plan = self._plan_within(LADDER[0], way, from_m, start, warm, rng)
        for share in LADDER[1:]:
            if plan.value[HARD] == 0.0:
                break
            plan = self._plan_within(share, way, from_m, start, warm, rng)
        return plan

    def _plan_within(
        self, share: float, way: Way, from_m: float, start: Array, warm: Way | None, rng: np.random.Generator
    ) -> LocalPlan:
        to_m, reference = self._reference_within(share, way, from_m, start)
        problem = self._problem(start, reference)
        seeds = np.array(list(self._seeds(problem, warm, to_m - from_m)))
        spread = self._spread(problem, seeds[0])
        settings = self.settings
        first = seeds[np.arange(settings.particles) % len(seeds)]
        first[len(seeds) :] += spread * rng.standard_normal(first[len(seeds) :].shape)
        swarm = new_swarm(first, settings.archive_size, settings.tabu_neighbours, settings.tabu_length)
        search(problem, swarm, spread, self._search_plan, rng)
        x, value = chosen(swarm, self.weights)
        knot_s = evaluate(x, problem, np.empty(5))
        return LocalPlan(problem.control, knot_s, value, to_m)

    @property
    def _search_plan(self) -> SearchPlan:
        settings = self.settings
        return SearchPlan(
            settings.iterations,
            settings.patience_generations,
            settings.weighted_dominance,
            settings.adaptive_leader,
            self.weights,
        )

    def _reference_within(self, share: float, way: Way, from_m: float, start: Array) -> tuple[float, Reference]:
        """Where the plan ends on the way, and its reference: both are kept within a share of the horizon."""
        reach_m, shortest_m = share * self.horizon.length_m, LADDER[-1] * self.horizon.length_m
        to_m = self._resting_place(way, from_m, reach_m)
        reference = self._reference(way, from_m, to_m, start)
        longest_s = share * self.horizon.duration_s
        if reference.duration_s > longest_s and to_m - from_m > shortest_m:
            reach_m = max((to_m - from_m) * longest_s / reference.duration_s, shortest_m)
            to_m = self._resting_place(way, from_m, reach_m)
            reference = self._reference(way, from_m, to_m, start)
        return to_m, reference

    def _reference(self, way: Way, from_m: float, to_m: float, start: Array) -> Reference:
        return lay_reference(way, from_m, to_m, start, self.shape.n_samples, self.limits, self.around)

    def _resting_place(self, way: Way, from_m: float, reach_m: float) -> float:
        """Arc [m] of the farthest sample within reach that is clear enough to rest there; the way's end always is."""
        if from_m + reach_m >= way.arc_m[-1]:
            return float(way.arc_m[-1])
        first, after = np.searchsorted(way.arc_m, (from_m, from_m + reach_m), side="right")
        free_m = np.empty(after - first)
        free_space(way.samples[first:after], 0.0, self.around, free_m)
        clear = np.flatnonzero(free_m >= self.limits.clearance_m)
        return float(way.arc_m[first + clear[-1]]) if len(clear) else from_m + reach_m

    def _problem(self, start: Array, reference: Reference) -> LocalProblem:
        points_m, n = np.ascontiguousarray(reference.samples[:, :3]), self.shape.n_samples
        return LocalProblem(
            start,
            reference,
            self.shape.fit_path @ points_m,
            ends_of(start[0], points_m[-1], self.around, self.limits),
            self.limits,
            self.around,
            self.shape.rows,
            self.shape.layout,
            np.empty((self.shape.n_control, 3)),
            np.empty((n, 9)),
            np.empty(n),
            np.empty(n),
        )

    def _seeds(self, problem: LocalProblem, warm: Way | None, length_m: float) -> Iterator[Array]:
        """Deterministic first particles: the reference at several time scales, the committed path, bows."""
        n_free = len(self.shape.layout)
        for scale in TIME_SCALES:
            yield np.concatenate(([np.log(scale)], np.zeros(3 * n_free)))
        if warm is not None:
            path = self._reference(warm, 0.0, min(length_m, float(warm.arc_m[-1])), problem.start)
            off = np.linalg.solve(self.shape.modes, self.shape.fit_path @ path.samples[:, :3] - problem.fitted_m)
            yield np.concatenate(([np.log(path.duration_s / problem.reference.duration_s)], off.T.ravel()))
        ahead = problem.reference.samples[-1, :3] - problem.start[0]
        left = np.array([-ahead[1], ahead[0], 0.0]) / max(float(np.hypot(ahead[0], ahead[1])), 1e-6)
        widest_m = problem.reference.samples[:, WIDTH].max()
        for direction in (left, -left, np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0])):
            bow = np.zeros((3, n_free))
            bow[:, 0] = widest_m * direction
            yield np.concatenate(([0.0], bow.ravel()))

    def _spread(self, problem: LocalProblem, seed: Array) -> Array:
        """(d,) how far around the seeds to look: half the corridor, or farther where the reference is blocked."""
        value = np.empty(5)
        evaluate(seed, problem, value)
        widest_m = problem.reference.samples[:, WIDTH].max()
        blocked = value[HARD] > 0.0
        spread_m = 0.5 * (max(widest_m, self.limits.clearance_m) if blocked else widest_m)
        return np.concatenate(([TIME_SPREAD], np.full(len(seed) - 1, spread_m)))
