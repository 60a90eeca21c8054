"""Objectives that plans are compared with: f* of the terrains, and the best known of generated ones.

`python -m tests.benchmarks.planner.references` makes long runs of the product, and of scipy's L-BFGS-B on the product's
gradients, and keeps in references.json whatever is better than what stands there.
"""

import argparse
import json
from pathlib import Path

import msgspec

from missions.generators import terrain
from missions.mission import Mission, load_mission
from tests.benchmarks.planner.attempt import Limits
from tests.benchmarks.planner.ours import plan_within
from tests.benchmarks.planner.peers import run_peer
from tests.benchmarks.planner.task import pose_straight

FILE = Path(__file__).with_name("references.json")
GENERATED = 20
"""Terrains of each size."""

PRACTICAL_OPTIMA = {
    "terrain-1-5uav": 1423.2,
    "terrain-2-5uav": 1488.3,
    "terrain-3-5uav": 1532.1,
    "terrain-1-10uav": 2808.0,
    "terrain-2-10uav": 2956.0,
    "terrain-3-10uav": 3048.4,
}
"""Without caps, by long runs of several optimisers before this planner was written: the f* of the required figures."""


def uncapped(mission: Mission) -> Mission:
    """The mission as the paper has it: more clearance and height always earn more (reading A)."""
    planner = msgspec.structs.replace(mission.planner, clearance_cap_m=None, height_cap_m=None)
    return msgspec.structs.replace(mission, name=f"{mission.name} uncapped", planner=planner)


def best_known(mission: Mission) -> float | None:
    """The lowest objective that is known of a mission, if it was ever worked on."""
    return json.loads(FILE.read_text()).get(mission.name)


def long_runs(mission: Mission, seeds: range, evaluations: int, cpu_s: float) -> float:
    """The best objective of long runs of the product and of L-BFGS-B from random starts."""
    found = [plan_within(mission, seed, evaluations=evaluations).objective for seed in seeds]
    for seed in seeds:
        attempt = run_peer("scipy L-BFGS-B", pose_straight(mission), seed, Limits(cpu_s))
        found += [plan.objective for plan in attempt.found[-1:]]
    return min(found)


def missions_of_the_benchmark() -> list[Mission]:
    """All missions whose optimum matters, with caps and without."""
    shipped = [load_mission(name) for name in PRACTICAL_OPTIMA]
    generated = [terrain(seed, vehicles) for vehicles in (5, 10) for seed in range(GENERATED)]
    return [version for mission in shipped + generated for version in (mission, uncapped(mission))]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=4, help="seeds of each mission")
    parser.add_argument("--evaluations", type=int, default=6000, help="of whole plans, in each run of the product")
    parser.add_argument("--cpu-s", type=float, default=4.0, help="of each run of L-BFGS-B")
    given = parser.parse_args()
    known: dict[str, float] = json.loads(FILE.read_text()) if FILE.exists() else {}
    for mission in missions_of_the_benchmark():
        found = long_runs(mission, range(1000, 1000 + given.runs), given.evaluations, given.cpu_s)
        known[mission.name] = round(min(found, known.get(mission.name, found)), 3)
        print(f"{mission.name}: {found:.3f}, best known {known[mission.name]:.3f}", flush=True)
        FILE.write_text(json.dumps(known, indent=1) + "\n")


if __name__ == "__main__":
    main()
