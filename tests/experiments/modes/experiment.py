"""Three modes in worlds that are not as mapped, over three links: flown in process, and judged by the truth."""

import os
import platform
import time
from collections.abc import Sequence
from itertools import product as combinations
from pathlib import Path

import numpy as np

from gcs.experiments.drawing import picture
from gcs.experiments.experiment import Experiment, Row, Run, product
from gcs.experiments.markdown import table
from gcs.experiments.statistics import numbers, select, share, spread
from gcs.flight.report import min_clearance_m
from gcs.settings import PlanningMode
from tests.experiments.modes.scenarios import Difference, Link, scenario
from tests.simulation.whole_system import WholeSystem

MODES = (PlanningMode.END_CLOUD, PlanningMode.CLOUD, PlanningMode.ONBOARD)
COLOURS = {PlanningMode.END_CLOUD: "#c1272d", PlanningMode.CLOUD: "#0000a7", PlanningMode.ONBOARD: "#008176"}
MODE_NAMES = {mode.value: mode for mode in MODES}
MISLED = (Difference.MISSING, Difference.MOVED, Difference.DEAD_END)
SLACK = 0.02
"""End-cloud may be this much less successful than the better of the other two."""
FLUKES = 0.1
"""A world that misleads may let so many of those through that it is meant for."""


def runs(seeds: Sequence[int]) -> list[Run]:
    """Seed by seed."""
    return product(
        seed=list(seeds),
        world=[world.name for world in Difference],
        link=[link.name for link in Link],
        mode=[mode.value for mode in MODES],
    )


def work(run: Run) -> Row:
    """Fly once."""
    flown = scenario(Difference[run.text("world")], Link[run.text("link")], run.number("seed"))
    mode = MODE_NAMES[run.text("mode")]
    system = WholeSystem(flown.mission, mode, seed=run.number("seed"), truth_mission=flown.truth)
    begun_s = time.perf_counter()
    report = system.fly()
    ways = [flight.in_flight() for flight in system.flown().values()]
    clearance_m = min(min_clearance_m(flown.truth, way) for way in ways)
    collided = clearance_m < flown.truth.limits.body_radius_m
    return {
        "success": report.success and not collided,
        "collided": collided,
        "flight_s": max(vehicle.flight_time_s for vehicle in report.vehicles) if report.vehicles else None,
        "path_m": float(np.mean([vehicle.path_length_m for vehicle in report.vehicles])) if report.vehicles else None,
        "clearance_m": round(clearance_m, 3),
        "separation_m": report.min_separation_m,
        "ground_link_bytes": system.wire.bytes,
        "cloud_replans": report.cloud_replans,
        "swap_s": report.swap_s_p50,
        "reason": "; ".join((*map(str, system.simulator.collisions), report.reason)),
        "wall_s": round(time.perf_counter() - begun_s, 1),
    }


def shortfalls(rows: Sequence[Row]) -> list[str]:
    """What the experiment promises and did not show, a line each; none if all is well."""
    found: list[str] = []
    for world, link in combinations(Difference, Link):
        cell = select(rows, world=world.name, link=link.name)
        rates = {
            mode: share(select(cell, mode=mode.value), "success") for mode in MODES if select(cell, mode=mode.value)
        }
        if len(rates) < len(MODES):
            continue
        both, better = rates[PlanningMode.END_CLOUD], max(rates[PlanningMode.CLOUD], rates[PlanningMode.ONBOARD])
        if both < better - SLACK:
            found.append(f"{world.value}, {link.value}: end-cloud {both:.0%}, the better of the other two {better:.0%}")
        if link is Link.GOOD and world in MISLED and both < 1.0:
            found.append(f"{world.value}, {link.value}: end-cloud {both:.0%}, required is 100 %")
        if world in MISLED and rates[PlanningMode.CLOUD] > FLUKES:
            found.append(f"{world.value}, {link.value}: cloud alone arrives in {rates[PlanningMode.CLOUD]:.0%}")
        if (world, link) == (Difference.DEAD_END, Link.GOOD) and rates[PlanningMode.ONBOARD] > FLUKES:
            found.append(f"{world.value}: onboard alone gets out of {rates[PlanningMode.ONBOARD]:.0%}: it is none")
    found += [f"{_name(row)}: failed without a reason" for row in rows if not row["success"] and not row["reason"]]
    return found


def summary(rows: Sequence[Row]) -> str:
    """Success, time, way and clearance of every cell, and what is not as it should be."""
    head = [
        "world",
        "link",
        "mode",
        "flights",
        "success",
        "collided",
        "flight s",
        "way m",
        "clearance m",
        "kB",
        "swap s",
    ]
    lines = [_line(rows, *cell) for cell in combinations(Difference, Link, MODES)]
    preface = (
        "Two vehicles in the paper's room, its obstacles moved by the seed; a pillar that the map lacks or has "
        "elsewhere stands on the way that the cloud plans; the dead end is a hall with an unmapped blind alley, deeper "
        "than a local planner remembers and searches. All flights in process on a virtual clock, judged by the "
        "simulator's truth. Median [quartiles]; clearance is that of the "
        "centre, a vehicle has 0.2 m radius; kB are those of the ground link, both ways, both vehicles."
    )
    missed = shortfalls(rows)
    verdict = _kept(rows) if not missed else "Not as promised:\n\n" + "\n".join(f"* {line}" for line in missed)
    failed = [f"* {_name(row)}: {row['reason']}" for row in rows if not row["success"]]
    reasons = "## Flights that failed\n\n" + "\n".join(failed) if failed else "No flight failed."
    took_min = sum(numbers(rows, "wall_s")) / 60.0
    machine = f"{len(rows)} flights in {took_min:.0f} minutes of one core: {platform.processor() or platform.machine()}"
    machine += f", {os.cpu_count()} cores, Python {platform.python_version()}."
    return "\n\n".join([preface, machine, table(head, lines), verdict, "![modes](modes.png)", reasons])


def _kept(rows: Sequence[Row]) -> str:
    """In how many worlds and over how many links all modes were flown, so that promises could be judged."""
    pairs = list(combinations(Difference, Link))
    flown = [{row["mode"] for row in select(rows, world=world.name, link=link.name)} for world, link in pairs]
    judged = sum(len(modes) == len(MODES) for modes in flown)
    left_out = "" if judged == len(pairs) else f" in the {judged} of {len(pairs)} pairs of world and link flown so far"
    return f"All promises kept{left_out}."


def figures(rows: Sequence[Row], directory: Path) -> list[str]:
    """Success of the three modes in every world, one picture for each link."""
    with picture(directory / "modes.png", 9.0, 3.0) as figure:
        for axes, link in zip(figure.subplots(1, len(Link), sharey=True), Link, strict=True):
            for offset, mode in enumerate(MODES):
                cells = [select(rows, world=world.name, link=link.name, mode=mode.value) for world in Difference]
                heights = [100.0 * share(cell, "success") if cell else 0.0 for cell in cells]
                places = np.arange(len(Difference)) + 0.27 * (offset - 1)
                axes.bar(places, heights, 0.25, color=COLOURS[mode], label=mode.value)
            axes.set_xticks(
                range(len(Difference)), [world.value.replace(" from the map", "") for world in Difference], fontsize=6
            )
            axes.set_title(link.value, fontsize=8)
        axes.legend(fontsize=6)
        figure.supylabel("flights that succeeded [%]", fontsize=8)
    return ["modes.png"]


def _line(rows: Sequence[Row], world: Difference, link: Link, mode: PlanningMode) -> list[str]:
    cell = select(rows, world=world.name, link=link.name, mode=mode.value)
    if not cell:
        return [world.value, link.value, mode.value, "0", *["–"] * 7]
    arrived = [row for row in cell if row["success"]]
    return [
        world.value,
        link.value,
        mode.value,
        str(len(cell)),
        f"{share(cell, 'success'):.0%}",
        f"{share(cell, 'collided'):.0%}",
        spread(numbers(arrived, "flight_s")),
        spread(numbers(arrived, "path_m")),
        spread(numbers(cell, "clearance_m"), ".2f"),
        spread([value / 1e3 for value in numbers(cell, "ground_link_bytes")], ".0f"),
        spread(numbers(cell, "swap_s"), ".2f"),
    ]


def _name(row: Row) -> str:
    return f"{Difference[str(row['world'])].value}, {Link[str(row['link'])].value}, {row['mode']}, seed {row['seed']}"


EXPERIMENT = Experiment(
    name="modes",
    title="End and cloud together, and either alone",
    default_runs=10,
    key=("seed", "world", "link", "mode"),
    values=(
        "success",
        "collided",
        "flight_s",
        "path_m",
        "clearance_m",
        "separation_m",
        "ground_link_bytes",
        "cloud_replans",
        "swap_s",
        "reason",
        "wall_s",
    ),
    runs=runs,
    work=work,
    figures=figures,
    summary=summary,
)
