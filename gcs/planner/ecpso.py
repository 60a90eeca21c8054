"""E-CPSO: the paper's particle swarm, whose parameters follow how far its particles have moved (section 2.2.2).

Ask for positions, tell their costs. Positions are in [-1, 1] per dimension. Every `window` iterations the swarm looks
at its mobility delta, the mean way of its particles over these iterations as a share of what their greatest speed
allows, and at whether its best has improved, and sets accordingly: inertia (eq. 9), learning factors (10, 11), greatest
speed (12), number of particles and who learns from whom (figure 4; docs/decisions/0013-adaptation.md). Each mechanism
can be switched off for ablation: the parameter then keeps the value of the paper's plain PSO.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

Fresh = Callable[[np.random.Generator, int], Array]
"""Draws (n, d) positions for particles that join the swarm."""

SEARCH_RANGE = 2.0
"""Positions are in [-1, 1]."""
POPULATION_STEP = 0.2
"""Share of the first population that leaves or joins at an adaptation."""


@dataclass(frozen=True)
class EcpsoSettings:
    """The paper's parameters (section 3.1.1); speeds are shares of the search range per iteration."""

    population: int = 24
    """Particles at the beginning, and at most (the paper's N_s, per vehicle)."""
    least_population: int = 8
    window: int = 5
    """k, iterations between two adaptations."""
    mobile: float = 0.3
    """lambda_1: with at least this mobility the swarm is in its fast, global search."""
    settled: float = 0.1
    """lambda_2: with at most this mobility it is caught near an optimum."""
    inertia: tuple[float, float] = (0.4, 0.9)
    """omega_min, omega_max."""
    learning: tuple[float, float] = (0.5, 3.5)
    """c_min, c_max."""
    speed: tuple[float, float] = (0.015, 0.03)
    """v_2, v_1."""
    adapt_inertia: bool = True
    adapt_learning: bool = True
    adapt_speed: bool = True
    adapt_population: bool = True
    adapt_topology: bool = True
    plain_inertia: float = 0.6
    plain_learning: float = 2.0
    plain_speed: float = 0.02


@dataclass(frozen=True)
class Parameters:
    """What drives the particles until the next adaptation."""

    inertia: float
    own_learning: float
    social_learning: float
    speed: float
    is_global: bool
    """All particles learn from the best of all, or each from the best of itself and its two neighbours on a ring."""


class Ecpso:
    """A swarm.

    Args:
        first: (n, d) first positions; the swarm keeps `settings.population` of them and fills up with fresh ones.
        fresh: draws positions for particles that join.
        settings: the paper's, unless an ablation says otherwise.
        rng: all randomness of the swarm.

    Example:
        >>> def fresh(rng, n):
        ...     return rng.uniform(-1.0, 1.0, (n, 2))
        >>> swarm = Ecpso(np.zeros((0, 2)), fresh, EcpsoSettings(), np.random.default_rng(1))
        >>> for _ in range(200):
        ...     swarm.tell(np.sum((swarm.ask() - 0.3) ** 2, axis=1))
        >>> swarm.best()[1] < 1e-4
        True
    """

    def __init__(self, first: Array, fresh: Fresh, settings: EcpsoSettings, rng: np.random.Generator) -> None:
        self._settings, self._fresh, self._rng = settings, fresh, rng
        missing = max(settings.population - len(first), 0)
        self._position = np.concatenate((first[: settings.population], fresh(rng, missing)))
        self._velocity = np.zeros_like(self._position)
        self._memory = self._position.copy()
        self._memory_cost = np.full(len(self._position), np.inf)
        self._iteration = 0
        self._since = (self._position.copy(), np.inf)
        self.parameters = adapted(1.0, True, settings)

    @property
    def memory(self) -> Array:
        """(n, d) the best position of each particle (pBest)."""
        return self._memory

    def best(self) -> tuple[Array, float]:
        """The best position so far, (d,), and its cost (gBest)."""
        index = int(np.argmin(self._memory_cost))
        return self._memory[index].copy(), float(self._memory_cost[index])

    def ask(self) -> Array:
        """(n, d) positions whose costs are to be told next."""
        if self._iteration > 0:
            self._move()
        return self._position

    def tell(self, costs: Array) -> None:
        """Take the (n,) costs of the positions asked for."""
        better = costs < self._memory_cost
        self._memory[better], self._memory_cost[better] = self._position[better], costs[better]
        self._iteration += 1
        if self._iteration % self._settings.window == 0:
            self._adapt()

    def remember(self, costs: Array) -> None:
        """Take new (n,) costs of the `memory`, when what costs depend on has changed."""
        self._memory_cost[:] = costs

    def offer(self, position: Array, cost: float) -> None:
        """Let a (d,) position that was found elsewhere take the place of the worst memory."""
        worst = int(np.argmax(self._memory_cost))
        if cost < self._memory_cost[worst]:
            self._memory[worst], self._memory_cost[worst] = position, cost

    def _move(self) -> None:
        now, shape = self.parameters, self._position.shape
        towards_own = now.own_learning * self._rng.random(shape) * (self._memory - self._position)
        towards_best = now.social_learning * self._rng.random(shape) * (self._leaders() - self._position)
        velocity = now.inertia * self._velocity + towards_own + towards_best  # (eq. 7)
        greatest = now.speed * SEARCH_RANGE
        self._velocity = np.clip(velocity, -greatest, greatest)
        moved = self._position + self._velocity  # (eq. 8)
        self._position = np.clip(moved, -1.0, 1.0)
        self._velocity[moved != self._position] = 0.0

    def _leaders(self) -> Array:
        """(n, d) or (d,): the best memory that each particle knows of."""
        if self.parameters.is_global:
            return self._memory[np.argmin(self._memory_cost)]
        n = len(self._memory)
        ring = (np.arange(n)[:, None] + np.array([-1, 0, 1])) % n
        return self._memory[ring[np.arange(n), np.argmin(self._memory_cost[ring], axis=1)]]

    def _adapt(self) -> None:
        before, best_before = self._since
        way = float(np.mean(np.abs(self._position - before)))
        mobility = way / (self._settings.window * self.parameters.speed * SEARCH_RANGE)
        improved = self.best()[1] < best_before
        self.parameters = adapted(mobility, improved, self._settings)
        if self._settings.adapt_population:
            self._leave() if improved else self._join()
        self._since = (self._position.copy(), self.best()[1])

    def _leave(self) -> None:
        """While the search gets on, the worst particles leave, which makes iterations cheaper."""
        count = max(len(self._position) - self._step(), self._settings.least_population)
        kept = np.sort(np.argsort(self._memory_cost, kind="stable")[:count])
        self._position, self._velocity = self._position[kept], self._velocity[kept]
        self._memory, self._memory_cost = self._memory[kept], self._memory_cost[kept]

    def _join(self) -> None:
        """When the search is stuck, fresh particles join it."""
        joining = self._fresh(self._rng, min(self._step(), self._settings.population - len(self._position)))
        self._position = np.concatenate((self._position, joining))
        self._velocity = np.concatenate((self._velocity, np.zeros_like(joining)))
        self._memory = np.concatenate((self._memory, joining))
        self._memory_cost = np.concatenate((self._memory_cost, np.full(len(joining), np.inf)))

    def _step(self) -> int:
        return max(round(POPULATION_STEP * self._settings.population), 1)


def adapted(mobility: float, improved: bool, settings: EcpsoSettings) -> Parameters:
    """The parameters that follow from a swarm's mobility delta and from whether its best improved (eqs. 9-12).

    Between the two thresholds, where the paper says nothing, they change linearly.
    """
    share = (mobility - settings.settled) / (settings.mobile - settings.settled)
    fast = min(max(share, 0.0), 1.0)

    def between(settled: float, mobile: float) -> float:
        return settled + fast * (mobile - settled)

    low, high = settings.learning
    learns = settings.adapt_learning
    return Parameters(
        inertia=between(settings.inertia[1], settings.inertia[0]) if settings.adapt_inertia else settings.plain_inertia,
        own_learning=between(low, high) if learns else settings.plain_learning,  # (eq. 10)
        social_learning=between(high, low) if learns else settings.plain_learning,  # (eq. 11)
        speed=between(settings.speed[0], settings.speed[1])
        if settings.adapt_speed
        else settings.plain_speed,  # (eq. 12)
        is_global=improved or not settings.adapt_topology,
    )
