"""The command line of the planner's benchmark; see the package."""

import argparse
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from rich.console import Console

from gcs.planner import compile_kernels
from tests.benchmarks.command_line import machine, seed_range
from tests.benchmarks.planner import contests
from tests.benchmarks.planner.contests import Part
from tests.benchmarks.planner.figures import Results
from tests.benchmarks.planner.hard import hard_worlds
from tests.benchmarks.planner.scope import Scope, quick

PARTS: dict[str, Callable[[Scope], Iterator[Part]]] = {
    "terrains": contests.terrains,
    "generated": contests.generated_terrains,
    "fleets": contests.fleets,
    "hard": hard_worlds,
    "shipped": contests.shipped,
    "peers": contests.peers,
}
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def main() -> int:
    """0 if every required figure is met, 1 if not, 2 for bad input."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.planner", description=__doc__)
    parser.add_argument("--seeds", type=seed_range, default=range(30), metavar="A:B", help="from A to B - 1")
    parser.add_argument("--quick", action="store_true", help="two seeds and a few worlds, less than two minutes")
    parser.add_argument("--only", choices=PARTS, action="append", help="this part; repeatable")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the tables there, too")
    given = parser.parse_args()
    results = Results(Console(width=None if sys.stdout.isatty() else 160))
    results.note(machine())
    results.console.print("compiling, warming up")
    _warm_up()
    scope = quick(given.seeds) if given.quick else Scope(given.seeds)
    for name in given.only or PARTS:
        for table, figures in PARTS[name](scope):
            results.add(table, figures)
    results.note(f"load average at the end {os.getloadavg()[0]:.1f}")
    return results.conclude(given.markdown)


def _in_one_thread() -> None:
    """Begin again with linear algebra that makes no threads, unless that is so already: they cost CPU time."""
    if any(os.environ.get(name) != "1" for name in THREADS):
        os.execve(sys.executable, sys.orig_argv, {**os.environ, **dict.fromkeys(THREADS, "1")})


def _warm_up() -> None:
    """Everything compiled and every world's code run once, none of which is measured."""
    compile_kernels()
    contests.warm_up()


if __name__ == "__main__":
    _in_one_thread()
    code = main()
    sys.stdout.flush()
    os._exit(code)  # OMPL's bindings would report every object they leak when Python ends
