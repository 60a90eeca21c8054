"""The worlds in which obstacles decide: everybody has the same CPU time, and OMPL's ways are given to its followers."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from missions.generators import HARD, Kind, generate
from missions.mission import Mission
from tests.benchmarks.planner.attempt import Attempt, Limits
from tests.benchmarks.planner.figures import Figure, Table
from tests.benchmarks.planner.guided import SEARCH_SHARE, Alone, alone, bit_star, guided
from tests.benchmarks.planner.ours import Run, plan_within
from tests.benchmarks.planner.peers import run_peer
from tests.benchmarks.planner.scope import Scope
from tests.benchmarks.planner.task import pose_straight

FOLLOWERS = ("scipy L-BFGS-B, straight", "pycma")
"""Peers that begin at OMPL's paths."""
STRAIGHT = ("pycma", "scipy L-BFGS-B, straight")
"""Peers that begin at straight lines."""
ROUNDING = 1e-3
"""Costs are compared to this share: the search shows the judge nothing that is better by less."""


@dataclass(frozen=True)
class Duel:
    """One world: ours, and the costs of all peers, infinite where the judge approved of nothing."""

    ours: Run
    peers: dict[str, float]
    unguided: Alone | None

    @property
    def best_peer(self) -> float:
        return min(self.peers.values())

    @property
    def above(self) -> float:
        """By which share of its cost ours is above the best peer's; minus infinity if no peer has a plan."""
        if not np.isfinite(self.best_peer):
            return -np.inf
        return (self.ours.cost - self.best_peer) / abs(self.best_peer)


def hard_worlds(scope: Scope) -> Iterator[tuple[Table, list[Figure]]]:
    """Feasible on every seed, at no more than the best peer's cost."""
    names = ["ours", *_peer_names(), "OMPL alone"]
    title = f"Hard worlds, {scope.hard_s:g} s for everybody: feasible plans, and median cost above ours"
    table, figures = Table(title, ("kind", *names)), []
    for kind in HARD:
        duels = [_duel(generate(kind, seed), seed, scope.hard_s) for seed in scope.seeds[: scope.hard_runs]]
        table.rows.append(_row(kind, duels))
        feasible = sum(duel.ours.feasible for duel in duels)
        figures.append(Figure(f"{kind.value}, feasible", feasible, len(duels), at_least=True, unit=f"of {len(duels)}"))
        not_above = sum(duel.above <= ROUNDING for duel in duels)
        what = f"{kind.value}, cost no higher than the best peer's at equal time"
        figures.append(Figure(what, not_above, len(duels), at_least=True, unit=f"of {len(duels)}"))
    yield table, figures


def _peer_names() -> list[str]:
    return [*STRAIGHT, *(f"OMPL + {name}" for name in FOLLOWERS)]


def _duel(mission: Mission, seed: int, cpu_s: float) -> Duel:
    ours, straight = plan_within(mission, seed, cpu_s=cpu_s), pose_straight(mission)
    attempts: dict[str, Attempt | None] = {name: run_peer(name, straight, seed, Limits(cpu_s)) for name in STRAIGHT}
    paths = bit_star(mission, seed, SEARCH_SHARE * cpu_s)
    attempts |= {f"OMPL + {name}": guided(name, mission, paths, seed, cpu_s) for name in FOLLOWERS}
    unguided = None if paths.polygons_m is None else alone(mission, paths.polygons_m)
    return Duel(ours, {name: _cost(attempt) for name, attempt in attempts.items()}, unguided)


def _cost(attempt: Attempt | None) -> float:
    return min((found.cost for found in attempt.found), default=np.inf) if attempt else np.inf


def _row(kind: Kind, duels: list[Duel]) -> tuple[str, ...]:
    ours = f"{sum(duel.ours.feasible for duel in duels)}/{len(duels)}"
    cells = [_cell(duels, [duel.peers[name] for duel in duels]) for name in _peer_names()]
    alone_feasible = sum(duel.unguided is not None and duel.unguided.violations == 0 for duel in duels)
    lone = [duel.unguided.cost if duel.unguided else np.inf for duel in duels]
    return (kind.value, ours, *cells, f"{alone_feasible}/{len(duels)}{_above(duels, lone)}")


def _cell(duels: list[Duel], costs: list[float]) -> str:
    return f"{sum(np.isfinite(costs))}/{len(duels)}{_above(duels, costs)}"


def _above(duels: list[Duel], costs: list[float]) -> str:
    """By how much costs are above ours in the median, where both have one."""
    both = [(cost, duel.ours.cost) for cost, duel in zip(costs, duels, strict=True) if duel.ours.feasible]
    shares = [(cost - ours) / abs(ours) for cost, ours in both if np.isfinite(cost)]
    return f", {100.0 * float(np.median(shares)):+.1f} %" if shares else ""
