"""Table 2: three terrains, 5 and 10 UAVs, six algorithms; once in the paper's representation, once in ours.

The shipped planner (representation, swarms, polish and judge together) stands beside them.
"""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes

from gcs.experiments.drawing import STYLES, picture
from gcs.experiments.experiment import Experiment, Row, Run, product
from gcs.experiments.markdown import table
from gcs.experiments.paper import ALGORITHMS, BEST_KNOWN, MISSIONS, printed
from gcs.experiments.statistics import (
    numbers,
    quartiles,
    rank_sum_p,
    select,
    share,
    signed_rank_p,
    significance,
    spread,
)
from gcs.experiments.trials import PAPER_EVALUATIONS, PAPER_POPULATION, Outcome, Trial, attempt, attempt_shipped
from gcs.planner.baselines import Representation

OFFSETS_EVALUATIONS = 6000
"""In our representation: a tenth of the paper's, after which all have long converged."""
EVALUATIONS = {"absolute": PAPER_EVALUATIONS, "offsets": OFFSETS_EVALUATIONS}
SHIPPED = "shipped"
NEAR = 1.01
"""Times the best known objective: what counts as solved where CPU times are compared."""

TITLES = {
    "absolute": f"As the paper has the algorithms: absolute coordinates, random start, {PAPER_EVALUATIONS} evaluations",
    "offsets": f"All in our representation, without polish, {OFFSETS_EVALUATIONS} evaluations",
}


def runs(seeds: Sequence[int]) -> list[Run]:
    """Seed by seed, so that an interrupted experiment has whole ones."""
    found: list[Run] = []
    for seed in seeds:
        for representation in TITLES:
            found += product(representation=[representation], mission=MISSIONS, algorithm=ALGORITHMS, seed=[seed])
        found += product(representation=[SHIPPED], mission=MISSIONS, algorithm=["ecpso"], seed=[seed])
    return found


def work(run: Run) -> Row:
    """One search."""
    mission, seed, near = run.text("mission"), run.number("seed"), NEAR * BEST_KNOWN[run.text("mission")]
    if run.text("representation") == SHIPPED:
        plan, course = attempt_shipped(mission, seed)
        objective, feasible, cpu_s, evaluations = plan.objective, plan.feasible, plan.cpu_s, float(plan.evaluations)
    else:
        outcome = search(mission, run)
        course, cpu_s, evaluations = outcome.course, outcome.cpu_s, outcome.evaluations
        objective, feasible = outcome.candidate.objective, not outcome.candidate.violations
    first = course.first_feasible()
    return {
        "ibc": course.converged_after() / PAPER_POPULATION,
        "fvc": objective,
        "feasible": feasible,
        "cost": course.final,
        "first_feasible_evaluations": None if first is None else first.evaluations,
        "evaluations": evaluations,
        "cpu_s": cpu_s,
        "cpu_near_best_s": course.cpu_to(near),
    }


def search(mission: str, run: Run) -> Outcome:
    """The search that a run's algorithm, representation and seed stand for, with the evaluations of table 2."""
    representation = Representation(run.text("representation"))
    most = EVALUATIONS[representation.value]
    return attempt(Trial(mission, run.text("algorithm"), representation, most, run.number("seed")))


def summary(rows: Sequence[Row]) -> str:
    """Both tables, the paper's numbers beside ours, and CPU times to a good plan."""
    parts = [_preface()]
    for representation, title in TITLES.items():
        parts.append(f"## {title}")
        here = select(rows, representation=representation)
        parts += [_table(here), _pooled(here)]
        parts.append(f"![{title}](table2-{representation}.png)")
    parts += [f"## Expected CPU time to {NEAR:g} f*", _cpu_preface(), _cpu_table(rows)]
    return "\n\n".join(parts)


def figures(rows: Sequence[Row], directory: Path) -> list[str]:
    """One picture of final objectives per representation."""
    drawn: list[str] = []
    for representation in TITLES:
        name = f"table2-{representation}.png"
        _draw(select(rows, representation=representation), directory / name)
        drawn.append(name)
    return drawn


def _preface() -> str:
    return (
        "IBC: first iteration (300 evaluations of whole plans) whose best is within 1 % of the run's final best. FVC: "
        "eq. 13, uncapped, of the plan that the run ends with, densely sampled; penalties are no part of it. "
        "Feasible after: iterations to the first plan that the judge approves of, of the runs that found one. "
        "Success: the judge finds no violation. Median [quartiles] of all runs. p: Wilcoxon's rank-sum test of FVC "
        "against E-CPSO; over all worlds, where runs of one world and seed are paired, his signed-rank test; both "
        "two-sided, not adjusted for the number of tests. f* is the best objective known to us."
    )


def _table(rows: Sequence[Row]) -> str:
    head = ["terrain, UAVs", "algorithm", "runs", "IBC", "paper", "FVC", "paper", "FVC / f*", "success", "CPU s", "p"]
    return table(head, [_line(rows, mission, name) for mission in MISSIONS for name in ALGORITHMS])


def _pooled(rows: Sequence[Row]) -> str:
    """All worlds together, each run against E-CPSO's with the same world and seed."""
    ours = {(row["mission"], row["seed"]): row for row in select(rows, algorithm="ecpso")}
    lines: list[list[str]] = []
    for algorithm in ALGORITHMS:
        here = [row for row in select(rows, algorithm=algorithm) if (row["mission"], row["seed"]) in ours]
        rivals = [ours[row["mission"], row["seed"]] for row in here]
        shares, rival = over_best(here), over_best(rivals)
        better = sum(own < other for own, other in zip(shares, rival, strict=True))
        success = f"{100.0 * share(here, 'feasible'):.0f} %" if here else "–"
        versus = ["", ""] if algorithm == "ecpso" else [str(better), significance(signed_rank_p(shares, rival))]
        first = [value / PAPER_POPULATION for value in numbers(here, "first_feasible_evaluations")]
        cells = [str(len(here)), spread(shares, ".3f"), success, spread(first), *versus]
        lines.append([STYLES[algorithm][0], *cells])
    head = ["all worlds", "runs", "FVC / f*", "success", "feasible after", "below E-CPSO", "p (signed rank)"]
    return table(head, lines)


def over_best(rows: Sequence[Row]) -> list[float]:
    """Final objectives as shares of the best known."""
    return [float(str(row["fvc"])) / BEST_KNOWN[str(row["mission"])] for row in rows]


def _line(rows: Sequence[Row], mission: str, algorithm: str) -> list[str]:
    here = select(rows, mission=mission, algorithm=algorithm)
    paper = printed(mission, algorithm)
    found = numbers(here, "fvc")
    rival = numbers(select(rows, mission=mission, algorithm="ecpso"), "fvc")
    return [
        mission.removeprefix("terrain-"),
        STYLES[algorithm][0],
        str(len(here)),
        spread(numbers(here, "ibc")),
        "none" if paper is None else str(paper.ibc),
        spread(found),
        "none" if paper is None else f"{paper.fvc:.1f}",
        f"{quartiles(found)[1] / BEST_KNOWN[mission]:.3f}" if found else "–",
        f"{100.0 * share(here, 'feasible'):.0f} %" if here else "–",
        spread(numbers(here, "cpu_s"), ".2f"),
        "" if algorithm == "ecpso" else significance(rank_sum_p(found, rival)),
    ]


def _cpu_preface() -> str:
    return (
        "Sum of the CPU times of all runs, the failed ones to their ends, divided by the number of runs that reached a "
        f"feasible plan of at most {NEAR:g} f*; in brackets, how many did."
    )


def _cpu_table(rows: Sequence[Row]) -> str:
    contestants = [(SHIPPED, "ecpso")] + [(kind, name) for kind in ("offsets", "absolute") for name in ALGORITHMS]
    head = ["planner"] + [mission.removeprefix("terrain-") for mission in MISSIONS]
    lines: list[list[str]] = []
    for representation, algorithm in contestants:
        label = "shipped planner" if representation == SHIPPED else f"{STYLES[algorithm][0]}, {representation}"
        here = select(rows, representation=representation, algorithm=algorithm)
        lines.append([label] + [_expected_cpu(select(here, mission=mission)) for mission in MISSIONS])
    return table(head, lines)


def _expected_cpu(rows: Sequence[Row]) -> str:
    reached = numbers(rows, "cpu_near_best_s")
    failed = numbers([row for row in rows if row["cpu_near_best_s"] is None], "cpu_s")
    if not reached:
        return f"never (0/{len(rows)})"
    return f"{(sum(reached) + sum(failed)) / len(reached):.2f} ({len(reached)}/{len(rows)})"


def _draw(rows: Sequence[Row], path: Path) -> None:
    with picture(path, 9.0, 5.0) as figure:
        panels = figure.subplots(2, 3)
        for mission in MISSIONS:
            terrain, fleet = mission.removeprefix("terrain-").split("-")
            axes = panels[0 if fleet == "5uav" else 1][int(terrain) - 1]
            _boxes(axes, select(rows, mission=mission), mission)


def _boxes(axes: Axes, rows: Sequence[Row], mission: str) -> None:
    found = [numbers(select(rows, algorithm=name), "fvc") or [float("nan")] for name in ALGORITHMS]
    axes.boxplot(found, tick_labels=[STYLES[name][0] for name in ALGORITHMS], whis=(0, 100))
    paper = [printed(mission, name) for name in ALGORITHMS]
    places = [index + 1 for index, cell in enumerate(paper) if cell is not None]
    axes.plot(places, [cell.fvc for cell in paper if cell is not None], "x", color="tab:red", label="paper")
    axes.axhline(BEST_KNOWN[mission], color="tab:green", linewidth=1.0, label="f*")
    axes.set_title(mission.removeprefix("terrain-"), fontsize=9)
    axes.tick_params(axis="x", labelsize=7, rotation=30)
    axes.tick_params(axis="y", labelsize=7)
    axes.legend(fontsize=6)


EXPERIMENT = Experiment(
    name="table2",
    title="Table 2: 3 terrains x {5, 10} UAVs x 6 algorithms",
    default_runs=30,
    key=("representation", "mission", "algorithm", "seed"),
    values=(
        "ibc",
        "fvc",
        "feasible",
        "cost",
        "first_feasible_evaluations",
        "evaluations",
        "cpu_s",
        "cpu_near_best_s",
    ),
    runs=runs,
    work=work,
    figures=figures,
    summary=summary,
)
