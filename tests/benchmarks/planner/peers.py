"""Optimisers of others, on the product's variables and costs, with settings that a few trials suggested.

Each runs until its attempt raises `Finished`, and starts anew whenever it has converged.
"""

import contextlib
import tempfile
import warnings
from collections.abc import Callable
from typing import Any

import cma
import numpy as np
import numpy.typing as npt
from pymoo.algorithms.soo.nonconvex.pso import PSO
from pymoo.core.problem import Problem as PymooProblem
from pymoo.optimize import minimize as pymoo_minimize
from scipy.optimize import Bounds, differential_evolution, minimize

from tests.benchmarks.planner.attempt import Attempt, Finished, Limits
from tests.benchmarks.planner.task import STRICTNESS, Task

Array = npt.NDArray[np.float64]
Peer = Callable[[Attempt, np.random.Generator], None]

SPREAD = 0.2
"""Standard deviation of random starts; offsets of one are half the search range."""
FOREVER = 10**6
"""Iterations: the attempt ends the search, not the optimiser."""
STAGES = (1.0, STRICTNESS)
"""Strictness of the penalty for descents: a light one first, as in the product."""


def _starts(attempt: Attempt, rng: np.random.Generator, count: int) -> Array:
    """(count, dimension) random starts, the first of them the straight lines."""
    starts = rng.normal(0.0, SPREAD, (count, attempt.task.dimension))
    if attempt.evaluations == 0:
        starts[0] = 0.0
    return starts


def _seed(rng: np.random.Generator) -> int:
    return int(rng.integers(1, 2**31))


def cma_es(attempt: Attempt, rng: np.random.Generator) -> None:
    """CMA-ES with its default population, restarted from random starts (pycma)."""
    while True:
        options = {"seed": _seed(rng), "verbose": -9}
        search = cma.CMAEvolutionStrategy(_starts(attempt, rng, 1)[0], SPREAD, options)
        while not search.stop():
            plans = search.ask()
            search.tell(plans, attempt.costs(np.array(plans)).tolist())


def cma_bipop(attempt: Attempt, rng: np.random.Generator) -> None:
    """BIPOP-CMA-ES: restarts with growing and with small populations (pycma)."""
    options = {"seed": _seed(rng), "verbose": -9}
    cma.fmin2(
        None,
        _starts(attempt, rng, 1)[0],
        SPREAD,
        options,
        restarts=FOREVER,
        bipop=True,
        parallel_objective=lambda plans: attempt.costs(np.array(plans)).tolist(),
    )


def differential(attempt: Attempt, rng: np.random.Generator) -> None:
    """Differential evolution, best1bin (scipy)."""
    start = _starts(attempt, rng, 60)
    box = Bounds(np.full(attempt.task.dimension, -1.0), np.full(attempt.task.dimension, 1.0))
    differential_evolution(
        lambda plans: attempt.costs(plans.T),
        box,
        init=np.clip(start, -1.0, 1.0),
        rng=rng,
        maxiter=FOREVER,
        tol=0.0,
        polish=False,
        vectorized=True,
        updating="deferred",
    )


def slsqp(attempt: Attempt, rng: np.random.Generator) -> None:
    """SLSQP on the product's gradients (scipy)."""
    _descents(attempt, rng, "SLSQP")


def l_bfgs_b(attempt: Attempt, rng: np.random.Generator) -> None:
    """L-BFGS-B on the product's gradients (scipy)."""
    _descents(attempt, rng, "L-BFGS-B")


def l_bfgs_b_by_differences(attempt: Attempt, rng: np.random.Generator) -> None:
    """L-BFGS-B as it does without gradients: differences of the cost (scipy)."""
    while True:
        plan = rng.normal(0.0, SPREAD, attempt.task.dimension)
        minimize(attempt.cost, plan, method="L-BFGS-B", options={"maxiter": FOREVER, "maxfun": FOREVER})


def l_bfgs_b_from_straight_lines(attempt: Attempt, rng: np.random.Generator) -> None:
    """L-BFGS-B as the product would use it: its gradients, its first plan, its stages of strictness (scipy)."""
    _descend(attempt, np.zeros(attempt.task.dimension), "L-BFGS-B")
    _descents(attempt, rng, "L-BFGS-B")


def _descents(attempt: Attempt, rng: np.random.Generator, method: str) -> None:
    while True:
        _descend(attempt, rng.normal(0.0, SPREAD, attempt.task.dimension), method)


def _descend(attempt: Attempt, plan: Array, method: str) -> None:
    for strictness in STAGES:
        arguments: dict[str, Any] = {"args": (strictness,), "jac": True, "options": {"maxiter": 1000}}
        plan = minimize(attempt.cost_and_gradient, plan, method=method, **arguments).x


def swarm(attempt: Attempt, rng: np.random.Generator) -> None:
    """Global-best particle swarm with Clerc and Kennedy's constriction (pyswarms)."""
    constriction = {"c1": 1.494, "c2": 1.494, "w": 0.729}
    np.random.seed(_seed(rng))  # noqa: NPY002  it has no other way in
    with tempfile.TemporaryDirectory() as scratch, contextlib.chdir(scratch):  # once imported, it writes a report.log
        import pyswarms

        search = pyswarms.single.GlobalBestPSO(
            50, attempt.task.dimension, constriction, init_pos=_starts(attempt, rng, 50)
        )
        search.optimize(attempt.costs, FOREVER, verbose=False)


def adaptive_swarm(attempt: Attempt, rng: np.random.Generator) -> None:
    """Particle swarm with adaptive inertia (pymoo)."""
    dimension = attempt.task.dimension

    class Posed(PymooProblem):
        def __init__(self) -> None:
            super().__init__(n_var=dimension, n_obj=1, xl=-1.0, xu=1.0)

        def _evaluate(self, plans: Array, out: dict[str, Array], *_: object, **__: object) -> None:
            out["F"] = attempt.costs(plans)[:, None]

    start = np.clip(_starts(attempt, rng, 50), -1.0, 1.0)
    pymoo_minimize(Posed(), PSO(pop_size=50, sampling=start), ("n_gen", FOREVER), seed=_seed(rng))


PEERS: dict[str, Peer] = {
    "pycma": cma_es,
    "pycma BIPOP": cma_bipop,
    "scipy DE": differential,
    "scipy SLSQP": slsqp,
    "scipy L-BFGS-B": l_bfgs_b,
    "scipy L-BFGS-B, differences": l_bfgs_b_by_differences,
    "scipy L-BFGS-B, straight": l_bfgs_b_from_straight_lines,
    "pyswarms": swarm,
    "pymoo PSO": adaptive_swarm,
}
"""By the name under which they are reported."""

ON_OUR_GRADIENTS = ("scipy SLSQP", "scipy L-BFGS-B", "scipy L-BFGS-B, straight")
"""These live on the product's hand-made derivatives: peers all the same (docs/decisions/0018-who-is-a-peer.md) ..."""
OURS_BUT_FOR_THE_DESCENT = ("scipy L-BFGS-B, straight",)
"""... and this one on its first plan and stages, too: it is shown, and no peer that the product has to be ahead of."""


def run_peer(name: str, task: Task, seed: int, limits: Limits, spent_s: float = 0.0) -> Attempt:
    """One attempt of one peer, until its limits end it."""
    attempt = Attempt(task, limits, spent_s)
    rng = np.random.default_rng([seed, list(PEERS).index(name)])
    with contextlib.suppress(Finished), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        PEERS[name](attempt, rng)
    return attempt
