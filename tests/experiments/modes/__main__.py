"""`make experiment-modes SEEDS=A:B`: fly, tabulate, and fail where a promise is not kept."""

import argparse
import sys
from pathlib import Path

from rich.console import Console

from gcs.experiments.command import Order, conduct
from tests.benchmarks.command_line import seed_range
from tests.experiments.modes.experiment import EXPERIMENT, shortfalls


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=seed_range, default=range(10), metavar="A:B", help="from A to B - 1")
    parser.add_argument("--output", type=Path)
    options = parser.parse_args()
    seeds: range = options.seeds
    order = Order("modes", len(seeds), seeds.start, None, options.output or Path("out/experiments"))
    console = Console(highlight=False, soft_wrap=True)
    again = f"make experiment-modes SEEDS={seeds.start}:{seeds.stop}"
    again += f" OUTPUT={options.output}" if options.output else ""
    rows = conduct(EXPERIMENT, order, console, again)
    missed = shortfalls(rows)
    for line in missed:
        console.print(line, markup=False)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
