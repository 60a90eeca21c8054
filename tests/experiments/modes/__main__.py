"""`make experiment-modes SEEDS=A:B`: fly, tabulate, and fail where a promise is not kept."""

import argparse
import sys
from pathlib import Path

from rich.console import Console

from gcs.experiments.command import Order, conduct
from tests.experiments.modes.experiment import EXPERIMENT, shortfalls


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="0:10", help="A:B, from A up to but not including B")
    parser.add_argument("--output", type=Path, default=Path("out/experiments"))
    options = parser.parse_args()
    first, _, end = options.seeds.partition(":")
    if not (first.isdecimal() and end.isdecimal() and int(first) < int(end)):
        parser.error(f"--seeds {options.seeds}: expected A:B with A < B")
    order = Order("modes", int(end) - int(first), int(first), None, options.output)
    console = Console(highlight=False, soft_wrap=True)
    rows = conduct(EXPERIMENT, order, console, f"make experiment-modes SEEDS={options.seeds}")
    missed = shortfalls(rows)
    for line in missed:
        console.print(line, markup=False)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
