"""What each part of the search is worth: the same flights with one part of the paper's method switched off."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from companion.settings import SearchSettings
from tests.benchmarks.onboard.flights import Score, fly
from tests.benchmarks.onboard.shortest import shortest_m
from tests.benchmarks.onboard.single import Part
from tests.benchmarks.onboard.worlds import COURSES, LIMITS
from tests.benchmarks.planner.figures import Table

COMPLETE = SearchSettings()
VARIANTS: dict[str, SearchSettings] = {
    "complete": COMPLETE,
    "Pareto dominance alone": replace(COMPLETE, weighted_dominance=False),
    "random leader": replace(COMPLETE, adaptive_leader=False),
    "no tabu search": replace(COMPLETE, tabu_neighbours=0),
    "no tabu search, as many evaluations": replace(COMPLETE, tabu_neighbours=0, particles=26),
    "first particles alone": replace(COMPLETE, iterations=0, tabu_neighbours=0),
    "50 particles, 30 generations": replace(COMPLETE, particles=50, iterations=30, stall_generations=30),
}
HEADER = (
    "world",
    "search",
    "success",
    "plans that fail",
    "replan ms median · p99",
    "path / shortest",
    "time s",
    "∫jerk²",
)
NO_PATH = "no path found"


def ablation(seeds: range, worlds: Iterable[str]) -> Iterator[Part]:
    """One table per world; nothing is required of it."""
    for world in worlds:
        table = Table(f"Ablation, {world}, {len(seeds)} flights each", HEADER)
        for name, search in VARIANTS.items():
            scores = {seed: fly(COURSES[world](seed), search)[0] for seed in seeds}
            table.rows.append(_row(world, name, scores))
        yield table, []


def _row(world: str, name: str, scores: dict[int, Score]) -> tuple[str, ...]:
    plan_ms = np.concatenate([score.plan_ms for score in scores.values()])
    failed = sum(text == NO_PATH for score in scores.values() for _, text in score.notes)
    arrived = {seed: score for seed, score in scores.items() if score.succeeded(LIMITS.body_radius_m)}
    ratios = [score.length_m / shortest_m(COURSES[world](seed)) for seed, score in arrived.items()]
    times_s, jerks = [s.time_s for s in arrived.values()], [s.jerk for s in arrived.values()]
    return (
        world,
        name,
        f"{len(arrived)}/{len(scores)}",
        f"{failed / len(plan_ms):.0%}",
        f"{np.median(plan_ms):.2f} · {np.percentile(plan_ms, 99):.1f}",
        *(
            f"{np.mean(found):.{digits}f}" if found else "–"
            for found, digits in ((ratios, 3), (times_s, 2), (jerks, 0))
        ),
    )
