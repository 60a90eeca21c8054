"""Shipped missions from the first heartbeat to the last vehicle at its target, judged by the simulator's truth."""

import os
import platform
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gcs.experiments.drawing import picture
from gcs.experiments.experiment import Experiment, Row, Run, product
from gcs.experiments.markdown import table
from gcs.experiments.statistics import numbers, select, share, spread
from gcs.flight.report import Flown
from missions.mission import Mission, load_mission
from tests.simulation.whole_system import WholeSystem

MISSIONS = (
    "indoor",
    "indoor-unmapped",
    "indoor-link-loss",
    "fleet-10",
    *(f"terrain-{terrain}-{fleet}uav" for fleet in (5, 10) for terrain in (1, 2, 3)),
)
SEPARATION_SHARE = 0.8
"""Of the mission's separation, which plans keep: tracking errors come on top, and outdoors those of positioning."""
AIRBORNE_M = 0.3


def runs(seeds: Sequence[int]) -> list[Run]:
    """Seed by seed."""
    return product(seed=list(seeds), mission=list(MISSIONS))


def work(run: Run) -> Row:
    """Fly once."""
    mission, seed = load_mission(run.text("mission")), run.number("seed")
    system = WholeSystem(mission, seed=seed)
    begun_s = time.perf_counter()
    report = system.fly()
    took_s = time.perf_counter() - begun_s
    vehicles = report.vehicles
    least_m = separation_m(mission, list(system.flown().values()))
    return {
        "vehicles": len(mission.vehicles),
        "success": report.success,
        "arrived": sum(vehicle.reached for vehicle in vehicles),
        "collided": sum(vehicle.collided for vehicle in vehicles),
        "flight_s": max((vehicle.flight_time_s for vehicle in vehicles), default=None),
        "path_m": float(np.mean([vehicle.path_length_m for vehicle in vehicles])) if vehicles else None,
        "clearance_m": min((vehicle.min_clearance_m for vehicle in vehicles), default=None),
        "separation_m": round(least_m, 2) if np.isfinite(least_m) else None,
        "separation_share": least_m / mission.limits.separation_m if np.isfinite(least_m) else None,
        "tracking_p99_m": max((vehicle.tracking_error_m_p99 for vehicle in vehicles), default=None),
        "offboard_losses": sum(vehicle.offboard_losses for vehicle in vehicles),
        "onboard_replans": sum(vehicle.onboard_replans for vehicle in vehicles),
        "cloud_replans": report.cloud_replans,
        "reason": "; ".join((*map(str, system.simulator.collisions), report.reason)),
        "simulated_s": round(report.sim_s, 1),
        "wall_s": round(took_s, 1),
    }


def separation_m(mission: Mission, flown: Sequence[Flown]) -> float:
    """The least distance between two vehicles in the air, of which one at least has left the launch zone [m].

    Infinite if there never were two. Within the zone they keep clear of each other's bodies: see collisions.
    """
    positions_m = np.stack([one.positions_m for one in flown], axis=1)  # (ticks, vehicles, 3)
    flies = positions_m[:, :, 2] > AIRBORNE_M
    launch_m = mission.launch_point_m
    at_start = np.zeros_like(flies)
    if launch_m is not None:
        at_start = np.linalg.norm(positions_m - np.array(launch_m), axis=2) < mission.launch_zone_radius_m
    least_m = float("inf")
    for one in range(len(flown) - 1):
        apart_m = np.linalg.norm(positions_m[:, one + 1 :] - positions_m[:, one : one + 1], axis=2)
        both_fly = flies[:, one + 1 :] & flies[:, one : one + 1]
        resting = at_start[:, one + 1 :] & at_start[:, one : one + 1]
        least_m = min(least_m, float(apart_m[both_fly & ~resting].min(initial=np.inf)))
    return least_m


def shortfalls(rows: Sequence[Row]) -> list[str]:
    """Flights that did not succeed, or in which two vehicles came too near to each other, a line each."""
    found = [f"{_name(row)}: {row['reason']}" for row in rows if not row["success"]]
    for row in rows:
        near = row["separation_share"]
        if isinstance(near, float) and near < SEPARATION_SHARE:
            found.append(f"{_name(row)}: vehicles were {row['separation_m']} m apart")
    return found


def summary(rows: Sequence[Row]) -> str:
    """Success, time, way, distances and plans of every mission, and what is not as it should be."""
    head = ["mission", "vehicles", "flights", "success", "flight s", "way m", "clearance m", "separation m"]
    head += ["tracking p99 m", "plans of a vehicle", "plans of the cloud", "times real time"]
    lines = [_line(select(rows, mission=mission)) for mission in MISSIONS if select(rows, mission=mission)]
    preface = (
        "End and cloud together, with lidar, noise and links as each mission has them; in process on a virtual clock, "
        "judged by the simulator's truth. Median [quartiles] of flights: the longest flight of a fleet, the mean way "
        "of its vehicles, the least clearance of any, the least distance of two in the air outside of their launch "
        f"zone, of which {SEPARATION_SHARE:.0%} of the mission's separation is required, the worst tracking error."
    )
    missed = shortfalls(rows)
    verdict = "Not as promised:\n\n" + "\n".join(f"* {line}" for line in missed) if missed else "All succeeded."
    took_min = sum(numbers(rows, "wall_s")) / 60.0
    machine = f"{len(rows)} flights in {took_min:.0f} minutes of one core: {platform.processor() or platform.machine()}"
    machine += f", {os.cpu_count()} cores, Python {platform.python_version()}."
    return "\n\n".join([preface, machine, table(head, lines), verdict, "![missions](missions.png)"])


def _line(rows: Sequence[Row]) -> list[str]:
    pace = [simulated_s / wall_s for simulated_s, wall_s in zip(*_both(rows, "simulated_s", "wall_s"), strict=True)]
    per_vehicle = [plans / n for plans, n in zip(*_both(rows, "onboard_replans", "vehicles"), strict=True)]
    return [
        str(rows[0]["mission"]),
        str(rows[0]["vehicles"]),
        str(len(rows)),
        f"{share(rows, 'success'):.0%}",
        spread(numbers(rows, "flight_s")),
        spread(numbers(rows, "path_m")),
        spread(numbers(rows, "clearance_m"), ".2f"),
        spread(numbers(rows, "separation_m"), ".2f"),
        spread(numbers(rows, "tracking_p99_m"), ".2f"),
        spread(per_vehicle, ".0f"),
        spread(numbers(rows, "cloud_replans"), ".0f"),
        spread(pace),
    ]


def _both(rows: Sequence[Row], one: str, other: str) -> tuple[list[float], list[float]]:
    return numbers(rows, one), numbers(rows, other)


def _name(row: Row) -> str:
    return f"{row['mission']}, seed {row['seed']}"


def figures(rows: Sequence[Row], directory: Path) -> list[str]:
    """How near vehicles came to each other, as a share of the mission's separation."""
    with picture(directory / "missions.png", 7.0, 3.0) as figure:
        axes = figure.subplots()
        for place, mission in enumerate(MISSIONS):
            shares = numbers(select(rows, mission=mission), "separation_share")
            axes.plot(shares, [place] * len(shares), "o", color="#0000a7", alpha=0.6)
        axes.axvline(1.0, color="#6b6b6b", linewidth=0.8)
        axes.axvline(SEPARATION_SHARE, color="#c1272d", linewidth=0.8)
        axes.set_yticks(range(len(MISSIONS)), MISSIONS, fontsize=7)
        axes.invert_yaxis()
        axes.set_xlabel("least distance of two vehicles / the mission's separation", fontsize=8)
    return ["missions.png"]


EXPERIMENT = Experiment(
    name="missions",
    title="Shipped missions, flown in full",
    default_runs=1,
    key=("seed", "mission"),
    values=(
        "vehicles",
        "success",
        "arrived",
        "collided",
        "flight_s",
        "path_m",
        "clearance_m",
        "separation_m",
        "separation_share",
        "tracking_p99_m",
        "offboard_losses",
        "onboard_replans",
        "cloud_replans",
        "reason",
        "simulated_s",
        "wall_s",
    ),
    runs=runs,
    work=work,
    figures=figures,
    summary=summary,
)
