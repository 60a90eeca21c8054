"""Figure 11: who flies where; and what the choice is worth, where vehicles start from different places."""

from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec
import numpy as np

from gcs.experiments.drawing import picture
from gcs.experiments.experiment import Experiment, Row, Run, product
from gcs.experiments.markdown import table
from gcs.experiments.scenery import draw_world
from gcs.experiments.statistics import numbers, rank_sum_p, select, share, significance, spread
from gcs.planner import plan_mission
from gcs.planner.allocation import allocate
from missions.generators import Kind, generate
from missions.mission import Mission, load_mission

MISSION = "terrain-1-5uav"
FLEETS = {"fleet-5": (Kind.FLEET, 5), "fleet-20": (Kind.FLEET, 20), "forest-4": (Kind.FOREST, 4)}
"""Generated missions: kind and number of vehicles."""
EVALUATIONS = 1500
"""Of the plan that an allocation is judged by."""

Rule = Callable[[Mission], dict[str, str]]


def in_order(mission: Mission) -> dict[str, str]:
    """The first vehicle flies to the first target, and so on."""
    return {vehicle.name: target.name for vehicle, target in zip(mission.vehicles, mission.targets, strict=True)}


def nearest_first(mission: Mission) -> dict[str, str]:
    """Again and again the vehicle and the target that are nearest to each other."""
    starts_m = np.array([mission.start_m(vehicle) for vehicle in mission.vehicles])
    targets_m = np.array([target.position_m for target in mission.targets])
    apart_m = np.linalg.norm(starts_m[:, None] - targets_m, axis=-1)
    chosen: dict[str, str] = {}
    for _ in mission.vehicles:
        vehicle, target = np.unravel_index(int(np.argmin(apart_m)), apart_m.shape)
        chosen[mission.vehicles[vehicle].name] = mission.targets[target].name
        apart_m[vehicle], apart_m[:, target] = np.inf, np.inf
    return chosen


def least_total(mission: Mission) -> dict[str, str]:
    """The planner's own."""
    return {route.name: route.targets[0].name for route in allocate(mission)}


RULES: dict[str, Rule] = {"planner": least_total, "nearest first": nearest_first, "in order": in_order}


def runs(seeds: Sequence[int]) -> list[Run]:
    """Every rule on every mission."""
    return product(seed=list(seeds), fleet=list(FLEETS), rule=list(RULES))


def work(run: Run) -> Row:
    """Allocate by one rule, and plan for it."""
    kind, vehicles = FLEETS[run.text("fleet")]
    mission = msgspec.structs.replace(generate(kind, run.number("seed"), vehicles), allocation=None)
    chosen = RULES[run.text("rule")](mission)
    plan = plan_mission(msgspec.structs.replace(mission, allocation=chosen), evaluations=EVALUATIONS)
    return {
        "length_m": sum(vehicle.length_m for vehicle in plan.vehicles),
        "objective": plan.objective,
        "feasible": plan.feasible,
    }


def summary(rows: Sequence[Row]) -> str:
    """Figure 11's allocation, and the rules compared."""
    chosen = ", ".join(f"{vehicle} to {target}" for vehicle, target in least_total(load_mission(MISSION)).items())
    head = ["fleet", "rule", "runs", "length / planner's", "feasible", "p"]
    lines = [_line(select(rows, fleet=fleet), fleet, rule) for fleet in FLEETS for rule in RULES]
    return "\n\n".join(
        [
            f"On terrain 1 all vehicles start from one point; every allocation is as good as any other: {chosen}.",
            "![allocation](allocation.png)",
            "Generated fleets start from different places. Length of all planned paths as a share of that with the "
            "planner's allocation, on the same mission; median [quartiles]. p: Wilcoxon's rank-sum test of lengths.",
            table(head, lines),
        ]
    )


def figures(rows: Sequence[Row], directory: Path) -> list[str]:
    """The allocation on terrain 1, as figure 11 shows it, and that of the first generated fleet."""
    fleet = generate(*_first_fleet(rows))
    with picture(directory / "allocation.png", 8.0, 3.8) as figure:
        for index, mission in enumerate((load_mission(MISSION), fleet)):
            axes = figure.add_subplot(1, 2, index + 1, projection="3d")
            draw_world(axes, mission.world)
            targets_m = {target.name: np.array(target.position_m) for target in mission.targets}
            for colour, vehicle in enumerate(mission.vehicles):
                name = least_total(mission)[vehicle.name]
                ends_m = np.array([mission.start_m(vehicle), targets_m[name]])
                axes.plot(*ends_m.T, color=f"C{colour}", linewidth=1.0)
                axes.plot(*ends_m[1:].T, "*", color=f"C{colour}", label=f"{vehicle.name}: {name}")
            axes.legend(fontsize=5, loc="upper left")
            axes.set_title(mission.name, fontsize=8)
    return ["allocation.png"]


def _first_fleet(rows: Sequence[Row]) -> tuple[Kind, int, int]:
    return Kind.FLEET, int(min(numbers(rows, "seed"))), 5


def _line(rows: Sequence[Row], fleet: str, rule: str) -> list[str]:
    here, ours = select(rows, rule=rule), select(rows, rule="planner")
    base_m = {row["seed"]: float(str(row["length_m"])) for row in ours}
    shares = [float(str(row["length_m"])) / base_m[row["seed"]] for row in here if row["seed"] in base_m]
    p = "" if rule == "planner" else significance(rank_sum_p(numbers(here, "length_m"), numbers(ours, "length_m")))
    feasible = f"{100.0 * share(here, 'feasible'):.0f} %" if here else "–"
    return [fleet, rule, str(len(here)), spread(shares, ".3f"), feasible, p]


EXPERIMENT = Experiment(
    name="allocation",
    title="Figure 11: target allocation",
    default_runs=10,
    key=("seed", "fleet", "rule"),
    values=("length_m", "objective", "feasible"),
    runs=runs,
    work=work,
    figures=figures,
    summary=summary,
)
