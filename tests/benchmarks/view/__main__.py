"""The command line of the page's benchmark; see the package."""

import argparse
import asyncio
import os
import platform
import sys
from pathlib import Path

import numpy as np
from rich.console import Console

from tests.benchmarks.planner.figures import Figure, Results, Table, number
from tests.benchmarks.view.measuring import Load, Opened, load, reloads

FLEET, SECONDS = 100, 12.0
MOST_CPU_MS, MOST_MB_PER_S, LONGEST_RELOAD_S = 2.0, 1.0, 2.0
MOST_SLOWED = 1.3
"""Beside a slow client a fast one may get this many times less."""
FLOWN_S, RELOADS = 1800.0, 5
WATCHED = (("one browser", 1, 0), ("a slow one, too", 1, 1), ("four browsers", 4, 0))


def main() -> int:
    """0 if every required figure is met, 1 if not."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.view", description=__doc__)
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the tables there, too")
    given = parser.parse_args()
    results = Results(Console(width=None if sys.stdout.isatty() else 160))
    machine = f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}"
    results.note(f"{machine}, load {os.getloadavg()[0]:.1f} at the start")
    loads = {name: asyncio.run(load(FLEET, SECONDS, fast=fast, slow=slow)) for name, fast, slow in WATCHED}
    results.add(*_loads(loads))
    results.add(*_reloads(*asyncio.run(reloads(FLEET, FLOWN_S, RELOADS))))
    return results.conclude(given.markdown)


def _loads(loads: dict[str, Load]) -> tuple[Table, list[Figure]]:
    header = (
        "watched by",
        "updates",
        "CPU ms: median",
        "mean",
        "95 %",
        "MB/s per client",
        "MB/s slow one",
        "late ms 95 %",
    )
    rows = [
        (
            name,
            str(len(found.cpu_ms)),
            number(float(np.median(found.cpu_ms))),
            number(float(found.cpu_ms.mean())),
            number(float(np.percentile(found.cpu_ms, 95))),
            number(found.fast_bytes_per_s / 1e6),
            number(found.slow_bytes_per_s / 1e6),
            number(float(np.percentile(found.late_ms, 95))),
        )
        for name, found in loads.items()
    ]
    alone, slowed = loads["one browser"], loads["a slow one, too"]
    ratio = float(np.median(slowed.cpu_ms) / np.median(alone.cpu_ms))
    figures = [
        Figure("an update, one browser", float(np.median(alone.cpu_ms)), MOST_CPU_MS, unit="ms"),
        Figure("sent to one client", alone.fast_bytes_per_s / 1e6, MOST_MB_PER_S, unit="MB/s"),
        Figure(
            "a fast client beside a slow one",
            slowed.fast_bytes_per_s / alone.fast_bytes_per_s,
            1 / MOST_SLOWED,
            at_least=True,
            unit="of its rate alone",
        ),
    ]
    title = f"{FLEET} vehicles with trails, 10 Hz, {SECONDS:g} s each; an update with a slow client: {ratio:.2f} times"
    return Table(title, header, rows), figures


def _reloads(ours: Opened, bare: Opened) -> tuple[Table, list[Figure]]:
    title = f"after {FLOWN_S / 60:g} minutes of flight, drawn in software: until panels and vehicles are there"
    header = (
        "page",
        "first opening, s",
        *(f"reload {number + 1}, s" for number in range(RELOADS)),
        "median of reloads, s",
    )
    named = (("the flight", ours), ("one box and one button", bare))
    rows = [
        (name, number(page.first_s), *map(number, page.again_s), number(float(np.median(page.again_s))))
        for name, page in named
    ]
    median_s = float(np.median(ours.again_s))
    return Table(title, header, rows), [Figure("reload, median", median_s, LONGEST_RELOAD_S, unit="s")]


if __name__ == "__main__":
    sys.exit(main())
