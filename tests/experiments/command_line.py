"""Command lines of experiments that fly the whole system in process: fly, tabulate, fail where a promise is broken."""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from rich.console import Console

from gcs.experiments.command import Order, conduct
from gcs.experiments.experiment import Experiment, Row
from tests.benchmarks.command_line import seed_range


def run(experiment: Experiment, shortfalls: Callable[[Sequence[Row]], Sequence[str]], about: str | None) -> int:
    """Read the command line and do what it says; the exit code.

    Args:
        experiment: what is flown.
        shortfalls: a line for every promise that its rows do not keep.
        about: for `--help`.
    """
    parser = argparse.ArgumentParser(description=about)
    default = range(experiment.default_runs)
    parser.add_argument("--seeds", type=seed_range, default=default, metavar="A:B", help="from A to B - 1")
    parser.add_argument("--output", type=Path, help="directory of the results")
    options = parser.parse_args()
    seeds: range = options.seeds
    order = Order(experiment.name, len(seeds), seeds.start, None, options.output or Path("out/experiments"))
    console = Console(highlight=False, soft_wrap=True)
    again = f"make experiment-{experiment.name} SEEDS={seeds.start}:{seeds.stop}"
    again += f" OUTPUT={options.output}" if options.output else ""
    missed = shortfalls(conduct(experiment, order, console, again))
    for line in missed:
        console.print(line, markup=False)
    return 1 if missed else 0
