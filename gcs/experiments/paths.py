"""Figure 12: the plans of the six algorithms on terrain 1 with 5 UAVs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gcs.experiments.drawing import STYLES, picture
from gcs.experiments.experiment import Experiment, Row, Run, product
from gcs.experiments.markdown import table
from gcs.experiments.scenery import draw_world
from gcs.experiments.series import from_cell, to_cell
from gcs.experiments.statistics import numbers, select, spread
from gcs.experiments.table2 import EVALUATIONS, search
from gcs.experiments.trials import uncapped
from gcs.planner.curves import curvature, path_lengths

MISSION = "terrain-1-5uav"
PANELS = ("ecpso", "pso", "ipso", "gapso", "ca", "aca")
"""Figure 12 a to f."""
DRAWN_SAMPLES = 80
"""Of each curve."""


def runs(seeds: Sequence[int]) -> list[Run]:
    """Seed by seed."""
    return product(seed=list(seeds), representation=list(EVALUATIONS), algorithm=PANELS)


def work(run: Run) -> Row:
    """One search; the plan is kept as samples of all curves, one after the other."""
    outcome = search(MISSION, run)
    curves_m = np.array([curve.curve_m for curve in outcome.candidate.curves])
    picked = np.linspace(0, len(curves_m[0]) - 1, DRAWN_SAMPLES).round().astype(int)
    return {
        "fvc": outcome.candidate.objective,
        "feasible": not outcome.candidate.violations,
        "length_m": float(path_lengths(curves_m).sum()),
        "least_turn_radius_m": 1.0 / max(float(curvature(curve_m).max()) for curve_m in curves_m),
        "curves_enu_m": to_cell(curves_m[:, picked].round(1).ravel()),
    }


def curves_of(row: Row) -> np.ndarray:
    """(vehicles, samples, 3) ENU [m]."""
    return from_cell(row["curves_enu_m"]).reshape(-1, DRAWN_SAMPLES, 3)


def summary(rows: Sequence[Row]) -> str:
    """Lengths and turns of the plans."""
    direct_m = sum(float(np.linalg.norm(target.position_m)) for target in uncapped(MISSION).targets)
    parts = [
        f"The pictures show the first seed. All straight lines together are {direct_m:.0f} m long; turns may be no "
        "tighter than 50 m. Median [quartiles]."
    ]
    for representation, most in EVALUATIONS.items():
        here = select(rows, representation=representation)
        if not here:
            continue
        head = ["algorithm", "runs", "objective", "length of all paths [m]", "least turn radius [m]", "feasible"]
        parts.append(f"## {representation}, {most} evaluations")
        parts.append(table(head, [_line(select(here, algorithm=name), name) for name in PANELS]))
        parts.append(f"![plans, {representation}](paths-{representation}.png)")
    return "\n\n".join(parts)


def figures(rows: Sequence[Row], directory: Path) -> list[str]:
    """Six plans from above and one side, per representation."""
    drawn = [(name, select(rows, representation=name)) for name in EVALUATIONS]
    return [_draw(here, directory, f"paths-{name}.png") for name, here in drawn if here]


def _draw(rows: Sequence[Row], directory: Path, name: str) -> str:
    world = uncapped(MISSION).world
    with picture(directory / name, 9.0, 6.4) as figure:
        for index, algorithm in enumerate(PANELS):
            axes = figure.add_subplot(2, 3, index + 1, projection="3d")
            draw_world(axes, world)
            here = select(rows, algorithm=algorithm)
            for curve_m in curves_of(here[0]) if here else ():
                axes.plot(*curve_m.T, color="black", linewidth=1.0)
                axes.plot(*curve_m[-1:].T, "*", color="tab:red", markersize=5)
            axes.set_title(f"({'abcdef'[index]}) {STYLES[algorithm][0]}", fontsize=9)
    return name


def _line(rows: Sequence[Row], algorithm: str) -> list[str]:
    return [
        STYLES[algorithm][0],
        str(len(rows)),
        spread(numbers(rows, "fvc")),
        spread(numbers(rows, "length_m"), ".0f"),
        spread(numbers(rows, "least_turn_radius_m"), ".0f"),
        f"{sum(row['feasible'] is True for row in rows)}/{len(rows)}",
    ]


EXPERIMENT = Experiment(
    name="paths",
    title="Figure 12: plans of six algorithms, terrain 1, 5 UAVs",
    default_runs=1,
    key=("seed", "representation", "algorithm"),
    values=("fvc", "feasible", "length_m", "least_turn_radius_m", "curves_enu_m"),
    runs=runs,
    work=work,
    figures=figures,
    summary=summary,
)
