"""The parts of the benchmark: each measures, and fills a table and figures."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gcs.planner import plan_mission
from missions.generators import HARD, Kind, fleet, generate, terrain
from missions.mission import Mission, load_mission, shipped_missions
from tests.benchmarks.planner.attempt import Attempt, Limits
from tests.benchmarks.planner.figures import Figure, Table, expected_time_s, number
from tests.benchmarks.planner.ours import Run, plan_within, time_to
from tests.benchmarks.planner.peers import ON_OUR_GRADIENTS, OURS_BUT_FOR_THE_DESCENT, PEERS, run_peer
from tests.benchmarks.planner.references import PRACTICAL_OPTIMA, best_known, long_runs, uncapped
from tests.benchmarks.planner.scope import NEAREST, Scope
from tests.benchmarks.planner.task import pose_straight

Part = tuple[Table, list[Figure]]

NEAR, VERY_NEAR = 1.01, 1.002
"""Shares of f* that are raced for."""

FIRST_S = {5: (0.02, 0.1), 10: (0.1, 0.3)}
"""By number of vehicles: median and worst CPU time of the first feasible plan."""
NEAR_S = {5: 0.1, 10: 0.3}
VERY_NEAR_S = {5: 0.3, 10: 1.0}
CAPPED_S = {5: 0.1, 10: 0.3}
"""To 1.002 f* with caps."""
TIMES_FASTER = {5: 5.0, 10: 10.0}
"""Than the best peer, to 1.01 f*."""
FLEET_S = {50: 1.0, 100: 4.0}
"""Median CPU time of the first feasible plan."""
MOST_S = 5.0
"""CPU time after which a run of the product counts as failed, with ten vehicles or fewer ..."""
MOST_FLEET_S = 30.0
"""... and with more."""
EQUAL_EVALUATIONS, EQUAL_S = 1500, {5: 0.3, 10: 1.0}
"""Budgets at which objectives are compared."""


@dataclass(frozen=True)
class Race:
    """Runs of the product on one mission or more: to any feasible plan, to 1.01 f* and to 1.002 f*."""

    first: list[Run]
    near: list[Run]
    very_near: list[Run]

    @staticmethod
    def run(entries: Sequence[tuple[Mission, float, int]]) -> "Race":
        """One run to each goal for every (mission, f*, seed)."""
        first, near, very_near = (
            [time_to(mission, seed, goal * optimum, MOST_S) for mission, optimum, seed in entries]
            for goal in (np.inf, NEAR, VERY_NEAR)
        )
        reached = [
            [_kept(run, goal * optimum) for run, (_, optimum, _) in zip(runs, entries, strict=True)]
            for runs, goal in ((near, NEAR), (very_near, VERY_NEAR))
        ]
        return Race(first, *reached)

    def row(self, name: str) -> tuple[str, ...]:
        times_s = [run.cpu_s for run in self.first]
        feasible = f"{sum(run.feasible for run in self.first)}/{len(self.first)}"
        first = f"{number(float(np.median(times_s)))} ({number(max(times_s))})"
        return (name, feasible, first, _summary(self.near), _summary(self.very_near))


RACE_HEADER = ("mission", "feasible", "first feasible: median (worst) s", "1.01 f*: ERT, median (worst) s", "1.002 f*")


def warm_up() -> None:
    """Run everything once that is measured: kernels are compiled, files are read, caches are filled."""
    plan_within(fleet(1000, 20), 0, evaluations=50)
    for kind in (Kind.TERRAIN, *HARD):
        mission = generate(kind, 1000)
        plan_within(mission, 0, evaluations=300)
        for name in PEERS:
            run_peer(name, pose_straight(mission), 0, Limits(0.05))


def terrains(scope: Scope) -> Iterator[Part]:
    """The product's times on the terrains of Table 2, without caps and with them."""
    names = [name for name in PRACTICAL_OPTIMA if int(name[8]) <= scope.terrains]
    table, figures = Table("Terrains of Table 2, uncapped (reading A)", RACE_HEADER), []
    for name in names:
        mission, vehicles = uncapped(load_mission(name)), int(name[10:-3])
        race = Race.run([(mission, PRACTICAL_OPTIMA[name], seed) for seed in scope.seeds])
        table.rows.append(race.row(name))
        figures += _first_figures(name, race, vehicles)
        figures.append(Figure(f"{name} to 1.01 f*, ERT", _ert(race.near), NEAR_S[vehicles]))
        figures.append(Figure(f"{name} to 1.002 f*, ERT", _ert(race.very_near), VERY_NEAR_S[vehicles]))
    yield table, figures
    table, figures = Table("Terrains of Table 2, capped (reading A50)", RACE_HEADER), []
    for name in names:
        mission, vehicles = load_mission(name), int(name[10:-3])
        race = Race.run([(mission, _optimum(mission), seed) for seed in scope.seeds])
        table.rows.append(race.row(name))
        figures += _first_figures(f"{name} capped", race, vehicles)
        figures.append(Figure(f"{name} capped to 1.002 f*, ERT", _ert(race.very_near), CAPPED_S[vehicles]))
    yield table, figures


def generated_terrains(scope: Scope) -> Iterator[Part]:
    """The same times over generated terrains, all of one size together."""
    table, figures = Table(f"{scope.generated} generated terrains of each size", RACE_HEADER), []
    for vehicles in (5, 10):
        capped = [terrain(seed, vehicles) for seed in range(scope.seeds.start, scope.seeds.start + scope.generated)]
        for what, missions in (("uncapped", [uncapped(mission) for mission in capped]), ("capped", capped)):
            entries = [(mission, _optimum(mission), seed) for mission in missions for seed in _few(scope)]
            race, name = Race.run(entries), f"generated, {vehicles} UAVs, {what}"
            table.rows.append(race.row(name))
            figures += _first_figures(name, race, vehicles)
            if what == "uncapped":
                figures.append(Figure(f"{name}, to 1.01 f*, ERT", _ert(race.near), NEAR_S[vehicles]))
                figures.append(Figure(f"{name}, to 1.002 f*, ERT", _ert(race.very_near), VERY_NEAR_S[vehicles]))
            else:
                figures.append(Figure(f"{name}, to 1.002 f*, ERT", _ert(race.very_near), CAPPED_S[vehicles]))
    yield table, figures


def fleets(scope: Scope) -> Iterator[Part]:
    """Time to the first feasible plan of large fleets; every seed is another world."""
    table = Table("Large fleets", ("vehicles", "feasible", "first feasible: median (worst) s"))
    figures = []
    for vehicles in scope.fleets:
        runs = [time_to(fleet(seed, vehicles), seed, np.inf, MOST_FLEET_S) for seed in scope.seeds[: scope.fleet_runs]]
        times_s, feasible = [run.cpu_s for run in runs], sum(run.feasible for run in runs)
        median_s = float(np.median(times_s))
        table.rows.append((str(vehicles), f"{feasible}/{len(runs)}", f"{number(median_s)} ({number(max(times_s))})"))
        figures.append(_all_feasible(f"{vehicles} vehicles", feasible, len(runs)))
        figures.append(Figure(f"{vehicles} vehicles, first feasible plan, median", median_s, FLEET_S[vehicles]))
    yield table, figures


def peers(scope: Scope) -> Iterator[Part]:
    """Ours beside every peer on the uncapped terrains: expected times, and objectives at equal budgets."""
    worlds = [(name, uncapped(load_mission(name)), optimum) for name, optimum in PRACTICAL_OPTIMA.items()]
    for name, mission, optimum in worlds:
        if int(name[8]) <= scope.terrains:
            yield _race_of_all(name, mission, optimum, scope.peers, scope)
    for vehicles in (5, 10):
        for seed in scope.seeds[: scope.contested]:
            mission = uncapped(terrain(seed, vehicles))
            yield _race_of_all(mission.name, mission, _optimum(mission), NEAREST, scope)


def shipped(scope: Scope) -> Iterator[Part]:
    """Every shipped mission with the default budget, for every seed."""
    table, figures = (
        Table("Shipped missions, default budget", ("mission", "feasible", "median CPU s", "spread of f")),
        [],
    )
    for name in shipped_missions():
        mission = load_mission(name)
        plans = [plan_mission(mission, seed=seed) for seed in scope.seeds]
        feasible = sum(plan.feasible for plan in plans)
        objectives = np.array([plan.objective for plan in plans])
        spread = f"{100.0 * np.ptp(objectives) / abs(objectives.mean()):.2f} %"
        cpu_s = number(float(np.median([plan.cpu_s for plan in plans])))
        table.rows.append((name, f"{feasible}/{len(plans)}", cpu_s, spread))
        figures.append(_all_feasible(f"shipped {name}", feasible, len(plans)))
    yield table, figures


def _race_of_all(name: str, mission: Mission, optimum: float, names: Sequence[str], scope: Scope) -> Part:
    vehicles, seeds = len(mission.vehicles), scope.seeds[: scope.peer_runs]
    goal, equal_s, most_s = NEAR * optimum, EQUAL_S[vehicles], scope.peer_s * vehicles / 5.0
    header = (
        "planner",
        "1.01 f*: ERT s",
        "reached",
        f"f/f* at {equal_s:g} s",
        f"f/f* at {EQUAL_EVALUATIONS} evaluations",
    )
    table, expected_s = Table(f"{name} beside its peers, {len(seeds)} seeds", header), {}
    ours = [_kept(time_to(mission, seed, goal, MOST_S), goal) for seed in seeds]
    in_time = [plan_within(mission, seed, cpu_s=equal_s).objective / optimum for seed in seeds]
    in_count = [plan_within(mission, seed, evaluations=EQUAL_EVALUATIONS).objective / optimum for seed in seeds]
    table.rows.append(("E-CPSO (ours)", number(_ert(ours)), _share(ours), _middle(in_time), _middle(in_count)))
    task = pose_straight(mission)
    for peer in names:
        run_peer(peer, task, 0, Limits(0.2))
        limits = Limits(most_s, goal, equal_s, EQUAL_EVALUATIONS)
        attempts = [run_peer(peer, task, seed, limits) for seed in seeds]
        row, expected_s[peer] = _peer_row(peer, attempts, goal, optimum, equal_s)
        table.rows.append(row)
    without = _best(expected_s, leave_out=ON_OUR_GRADIENTS)
    ratio = number(expected_s[without] / _ert(ours))
    table.rows.append(
        (f"best without our gradients: {without}", number(expected_s[without]), f"{ratio} x ours", "", "")
    )
    best = _best(expected_s, leave_out=OURS_BUT_FOR_THE_DESCENT)
    what = f"{name}: times faster to 1.01 f* than the best peer ({best})"
    return table, [Figure(what, expected_s[best] / _ert(ours), TIMES_FASTER[vehicles], at_least=True, unit="times")]


def _best(expected_s: dict[str, float], leave_out: Sequence[str]) -> str:
    return min((peer for peer in expected_s if peer not in leave_out), key=lambda peer: expected_s[peer])


def _peer_row(
    peer: str, attempts: Sequence[Attempt], goal: float, optimum: float, equal_s: float
) -> tuple[tuple[str, ...], float]:
    hits = [attempt.first_at(goal) for attempt in attempts]
    times_s = [hit.cpu_s if hit else attempt.limits.cpu_s for hit, attempt in zip(hits, attempts, strict=True)]
    ert_s = expected_time_s(times_s, [hit is not None for hit in hits])
    in_time = [attempt.best_within(cpu_s=equal_s) for attempt in attempts]
    in_count = [attempt.best_within(evaluations=EQUAL_EVALUATIONS) for attempt in attempts]
    shares = [[found.objective / optimum if found else np.inf for found in column] for column in (in_time, in_count)]
    reached = f"{sum(hit is not None for hit in hits)}/{len(hits)}"
    return (peer, number(ert_s), reached, _middle(shares[0]), _middle(shares[1])), ert_s


def _optimum(mission: Mission) -> float:
    """The best known objective, or what shorter long runs find at once where nobody has worked on the mission."""
    known = best_known(mission)
    return known if known is not None else long_runs(mission, range(1000, 1002), 3000, 2.0)


def _kept(run: Run, goal: float) -> Run:
    """The run, without an objective where it is not what was asked for."""
    return run if run.objective <= goal else Run(run.cpu_s, np.inf, np.inf, run.evaluations, run.violations)


def _ert(runs: Sequence[Run]) -> float:
    return expected_time_s([run.cpu_s for run in runs], [np.isfinite(run.objective) for run in runs])


def _summary(runs: Sequence[Run]) -> str:
    times_s = [run.cpu_s if np.isfinite(run.objective) else np.inf for run in runs]
    return f"{number(_ert(runs))}, {number(float(np.median(times_s)))} ({number(max(times_s))})"


def _first_figures(name: str, race: Race, vehicles: int) -> list[Figure]:
    median_s, worst_s = FIRST_S[vehicles]
    times_s = [run.cpu_s for run in race.first]
    runs = race.first + race.near + race.very_near
    return [
        _all_feasible(name, sum(run.feasible for run in runs), len(runs)),
        Figure(f"{name}, first feasible plan, median", float(np.median(times_s)), median_s),
        Figure(f"{name}, first feasible plan, worst", max(times_s), worst_s),
    ]


def _all_feasible(what: str, feasible: int, runs: int) -> Figure:
    return Figure(f"{what}, feasible runs", feasible, runs, at_least=True, unit=f"of {runs}")


def _share(runs: Sequence[Run]) -> str:
    return f"{sum(bool(np.isfinite(run.objective)) for run in runs)}/{len(runs)}"


def _middle(shares: Sequence[float]) -> str:
    median = float(np.median(shares))
    return f"{median:.4f}" if np.isfinite(median) else "–"


def _few(scope: Scope) -> range:
    return scope.seeds[: scope.generated_runs]
