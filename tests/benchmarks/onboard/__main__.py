"""The command line of the onboard planner's benchmark; see the package."""

import argparse
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from rich.console import Console

from tests.benchmarks.command_line import machine, seed_range
from tests.benchmarks.onboard.ablation import ablation
from tests.benchmarks.onboard.closed_loop import closed_loop
from tests.benchmarks.onboard.flights import fly
from tests.benchmarks.onboard.processes import processes
from tests.benchmarks.onboard.single import Part, single_vehicles
from tests.benchmarks.onboard.worlds import COURSES
from tests.benchmarks.planner.figures import Results


def compared(seeds: range, worlds: list[str]) -> Iterator[Part]:
    """Beside OMPL and pymoo, which need not be there for the other parts."""
    from tests.benchmarks.onboard.peers import peers

    yield from peers(seeds, worlds)


STANDING = ["room", "forest50", "forest100", "forest200"]
PARTS: dict[str, tuple[Callable[[range, list[str]], Iterator[Part]], list[str]]] = {
    "single": (single_vehicles, list(COURSES)),
    "closed-loop": (closed_loop, STANDING),
    "processes": (processes, []),
    "ablation": (ablation, ["room", "forest100"]),
    "peers": (compared, ["room", "forest100", "forest200"]),
}
"""By name; and the worlds that each flies through unless it is told others."""
REQUIRED = ["single", "closed-loop", "processes"]
QUICK_SEEDS = 2
WARM_UP_SEED = 10_000


def main() -> int:
    """0 if every required figure is met, 1 if not, 2 for bad input."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.onboard", description=__doc__)
    parser.add_argument("--seeds", type=seed_range, default=range(50), metavar="A:B", help="from A to B - 1")
    parser.add_argument("--quick", action="store_true", help="the first two seeds alone")
    parser.add_argument(
        "--only", choices=PARTS, action="append", help="this part; repeatable; without it, what has required figures"
    )
    parser.add_argument("--world", choices=COURSES, action="append", help="this world; repeatable")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the tables there, too")
    given = parser.parse_args()
    results = Results(Console(width=None if sys.stdout.isatty() else 200))
    results.note(machine())
    results.console.print("compiling, warming up")
    for name in ("room", "dynamic"):
        fly(COURSES[name](WARM_UP_SEED))
    seeds = given.seeds[:QUICK_SEEDS] if given.quick else given.seeds
    for name in given.only or REQUIRED:
        part, worlds = PARTS[name]
        for table, figures in part(seeds, given.world or worlds):
            results.add(table, figures)
    results.note(f"load average at the end {os.getloadavg()[0]:.1f}")
    return results.conclude(given.markdown)


if __name__ == "__main__":
    sys.exit(main())
