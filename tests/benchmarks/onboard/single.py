"""One vehicle crosses every world with every seed: the tables, and the figures that are required."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from tests.benchmarks.onboard.flights import Score, fly
from tests.benchmarks.onboard.shortest import shortest_m
from tests.benchmarks.onboard.worlds import COURSES, LIMITS, Course
from tests.benchmarks.planner.figures import Figure, Table

Part = tuple[Table, list[Figure]]

SUCCESS_SHARE = {"room": 1.0, "forest50": 1.0, "forest100": 1.0, "forest200": 0.98, "dynamic": 0.96}
REPLAN_MS = {"room": (1.5, 4.0), "forest200": (2.0, 7.0)}
PATH_RATIO = {"room": 1.02, "forest50": 1.02, "forest100": 1.03}
TIME_S = {"room": 9.0, "forest100": 12.8}
JERK = {"room": 650.0}
TICK_MS = 0.1
HEADER = (
    "world",
    "success",
    "replan ms median · mean · p99",
    "tick ms median",
    "map ms median · p99",
    "path / shortest",
    "time s",
    "clearance m, least",
    "speed m/s, acceleration m/s², highest",
    "∫jerk² m²/s⁵",
)


@dataclass
class Flown:
    """All flights of one world."""

    name: str
    scores: list[Score] = field(default_factory=list)
    ratios: list[float] = field(default_factory=list)
    failed: list[int] = field(default_factory=list)

    def add(self, course: Course, score: Score) -> None:
        self.scores.append(score)
        if score.succeeded(LIMITS.body_radius_m):
            self.ratios.append(score.length_m / shortest_m(course))
        else:
            self.failed.append(course.seed)

    def of_all(self, name: str) -> list[float]:
        """A list of every score, in one."""
        return [value for score in self.scores for value in getattr(score, name)]

    def mean(self, name: str) -> float:
        """A number of the flights that succeeded, on average."""
        kept = [getattr(score, name) for score in self.scores if score.succeeded(LIMITS.body_radius_m)]
        return float(np.mean(kept)) if kept else float("inf")

    @property
    def ratio(self) -> float:
        return float(np.mean(self.ratios)) if self.ratios else float("inf")

    @property
    def row(self) -> tuple[str, ...]:
        plan, ticks, maps = self.of_all("plan_ms"), self.of_all("tick_ms"), self.of_all("map_ms")
        clearance_m = min(score.clearance_m for score in self.scores)
        speed_m_s = max(score.speed_m_s for score in self.scores)
        acceleration = max(score.acceleration_m_s2 for score in self.scores)
        success = f"{len(self.ratios)}/{len(self.scores)}"
        return (
            self.name,
            success + (f", not {', '.join(map(str, self.failed))}" if self.failed else ""),
            f"{np.median(plan):.2f} · {np.mean(plan):.2f} · {np.percentile(plan, 99):.1f}",
            f"{np.median(ticks):.3f}",
            f"{np.median(maps):.2f} · {np.percentile(maps, 99):.1f}",
            f"{self.ratio:.3f}",
            f"{self.mean('time_s'):.2f}",
            f"{clearance_m:.2f}",
            f"{speed_m_s:.2f}, {acceleration:.1f}",
            f"{self.mean('jerk'):.0f}",
        )

    @property
    def figures(self) -> Iterator[Figure]:
        """What is required of this world."""
        share, name = len(self.ratios) / len(self.scores), self.name
        yield Figure(f"{name}: flights that succeed", share, SUCCESS_SHARE[name], at_least=True, unit="of all")
        plan = self.of_all("plan_ms")
        if name in REPLAN_MS:
            median_ms, most_ms = REPLAN_MS[name]
            yield Figure(f"{name}: replan, median", float(np.median(plan)), median_ms, unit="ms")
            yield Figure(f"{name}: replan, 99th percentile", float(np.percentile(plan, 99)), most_ms, unit="ms")
        if name in PATH_RATIO:
            yield Figure(f"{name}: path against the shortest", self.ratio, PATH_RATIO[name], unit="times")
        if name in TIME_S:
            yield Figure(f"{name}: flight time", self.mean("time_s"), TIME_S[name])
        if name in JERK:
            yield Figure(f"{name}: integral of squared jerk", self.mean("jerk"), JERK[name], unit="m2/s5")


def single_vehicles(seeds: range, worlds: Iterable[str]) -> Iterator[Part]:
    """Fly; one table for all worlds."""
    table, figures, ticks = Table("One vehicle, ideal tracking", HEADER), [], []
    for name in worlds:
        flown = Flown(name)
        for seed in seeds:
            course = COURSES[name](seed)
            flown.add(course, fly(course)[0])
        table.rows.append(flown.row)
        figures += flown.figures
        ticks += flown.of_all("tick_ms")
    figures.append(Figure("all worlds: 10 Hz ticks, median", float(np.median(ticks)), TICK_MS, unit="ms"))
    yield table, figures
