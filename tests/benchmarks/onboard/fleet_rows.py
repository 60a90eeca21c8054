"""The rows of several vehicles: who gets through, how far apart they stay, at what link.

`python -m tests.benchmarks.onboard.fleet_rows --seeds 0:10 [--only swap] [--link ideal] [--markdown FILE]` prints them
alone, and ends with 1 if a required figure is missed.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from rich.console import Console

from tests.benchmarks.command_line import seed_range
from tests.benchmarks.onboard.fleets import FLEETS, LINKS, fly_together
from tests.benchmarks.onboard.flights import Score
from tests.benchmarks.onboard.worlds import LIMITS
from tests.benchmarks.planner.figures import Figure, Results, Table, number

LEAST_SEPARATION_M = 0.6
"""On an ideal link; elsewhere nobody may touch anybody."""
HEADER = ("fleet", "link", "success", "least separation m", "least clearance m", "flight time s", "replan ms")


def fleet_rows(
    seeds: Sequence[int], fleets: Sequence[str] = tuple(FLEETS), links: Sequence[str] = tuple(LINKS)
) -> Iterator[tuple[Table, list[Figure]]]:
    """One table per fleet, with what is required of it: every flight succeeds, at every link."""
    for fleet in fleets:
        table, figures = Table(f"{fleet}, {len(seeds)} flights at each link", HEADER), list[Figure]()
        for link in links:
            flights = [fly_together(FLEETS[fleet](seed), LINKS[link]) for seed in seeds]
            table.rows.append(_row(fleet, link, flights))
            figures += _figures(fleet, link, flights)
        yield table, figures


def _row(fleet: str, link: str, flights: list[list[Score]]) -> tuple[str, ...]:
    scores = [score for flight in flights for score in flight]
    plan_ms = np.concatenate([score.plan_ms for score in scores])
    return (
        fleet,
        link,
        f"{_successes(flights)}/{len(flights)}",
        number(min(score.separation_m for score in scores)),
        number(min(score.clearance_m for score in scores)),
        f"{np.median([score.time_s for score in scores]):.1f}, at most {max(score.time_s for score in scores):.1f}",
        f"{np.median(plan_ms):.1f}, p99 {np.quantile(plan_ms, 0.99):.1f}",
    )


def _figures(fleet: str, link: str, flights: list[list[Score]]) -> Iterator[Figure]:
    what = f"{fleet}, {link}"
    yield Figure(f"{what}: flights that succeed", _successes(flights), len(flights), at_least=True, unit="flights")
    if link == "ideal":
        least_m = min(score.separation_m for flight in flights for score in flight)
        yield Figure(f"{what}: separation", least_m, LEAST_SEPARATION_M, at_least=True, unit="m")


def _successes(flights: list[list[Score]]) -> int:
    """Flights in which everybody arrives, and nobody touches anything or anybody."""
    return sum(all(score.succeeded(LIMITS.body_radius_m) for score in flight) for flight in flights)


def main() -> int:
    """0 if every required figure is met, 1 if not."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.onboard.fleet_rows", description=__doc__)
    parser.add_argument("--seeds", type=seed_range, default=range(10), metavar="A:B", help="from A to B - 1")
    parser.add_argument("--only", choices=FLEETS, action="append", help="this fleet; repeatable")
    parser.add_argument("--link", choices=LINKS, action="append", help="this link; repeatable")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the tables there, too")
    given = parser.parse_args()
    results = Results(Console(width=None if sys.stdout.isatty() else 160))
    for table, figures in fleet_rows(given.seeds, given.only or tuple(FLEETS), given.link or tuple(LINKS)):
        results.add(table, figures)
    if given.markdown is not None:
        given.markdown.write_text(results.markdown())
    return 1 if results.missed else 0


if __name__ == "__main__":
    sys.exit(main())
