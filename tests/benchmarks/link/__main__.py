"""The ground link's figures: the upload matrix, peers over real UDP, and a fleet of a hundred.

The exit code is not 0 if a required figure is missed.
"""

import argparse
import statistics
import sys
from collections.abc import Iterator
from pathlib import Path

from tests.benchmarks.command_line import machine, seed_range
from tests.benchmarks.link import fleet, matrix, peers
from tests.benchmarks.link.conditions import ONE_WAY_DELAY_S, USUAL_ITEMS

DELAY = f"{1e3 * ONE_WAY_DELAY_S:.0f} ms each way"


def main() -> int:
    """0 if every required figure is met, 1 if not."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.link", description=__doc__)
    parser.add_argument("--seeds", type=seed_range, default=range(30), metavar="A:B", help="from A to B - 1")
    parser.add_argument("--quick", action="store_true", help="no 1000 items, few trials with the peers")
    parser.add_argument("--only", choices=("matrix", "peers", "fleet", "fleets"), help="one part alone")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the tables there, too")
    given = parser.parse_args()
    missed: list[str] = []
    lines = [machine(), ""]
    print(*lines, sep="\n", flush=True)
    parts = {
        "matrix": lambda: _matrix(given.seeds, given.quick, missed),
        "peers": lambda: _peers(1 if given.quick else 3),
        "fleet": lambda: _fleet(missed),
        "fleets": lambda: _fleets(given.quick, missed),
    }
    for name, part in parts.items():
        if given.only in (None, name):
            for line in part():
                lines.append(line)
                print(line, flush=True)
    verdict = "All required figures are met." if not missed else "Missed: " + "; ".join(missed)
    print(verdict)
    if given.markdown is not None:
        given.markdown.write_text("\n".join([*lines, verdict]) + "\n")
    return 1 if missed else 0


def _matrix(seeds: range, quick: bool, missed: list[str]) -> Iterator[str]:
    yield f"## Uploads in virtual time, {DELAY}, loss both ways"
    yield ""
    header = ("items", "loss", "right", "accepted, s (median)", "allowed", "verified, s", "item messages per item")
    yield "| " + " | ".join((*header, "frames up per item")) + " |"
    yield "|---|---|---|---|---|---|---|---|"
    for cell in matrix.matrix(seeds, quick=quick):
        missed += cell.missed()
        limit_s = matrix.LONGEST_ACCEPTED_S.get((cell.n_items, cell.loss))
        allowed = f"{matrix.TOLERANCE * limit_s:.2f}" if limit_s is not None else "–"
        yield (
            f"| {cell.n_items} | {cell.loss:.0%} | {cell.right}/{len(cell.trials)} | {cell.accepted_s:.2f} | {allowed} "
            f"| {cell.verified_s:.2f} | {cell.messages_per_item:.2f} | {cell.frames_up_per_item:.1f} |"
        )
    yield ""


def _peers(n_trials: int) -> Iterator[str]:
    yield f"## {USUAL_ITEMS} items over real UDP to the simulator, {DELAY}"
    yield ""
    yield "| client | loss | says stored | s (median), as long as it took or until it gave up |"
    yield "|---|---|---|---|"
    for row in peers.compare(n_trials):
        seconds = statistics.median(attempt.seconds for attempt in row.attempts)
        yield f"| {row.client} | {row.loss:.0%} | {row.stored}/{len(row.attempts)} | {seconds:.1f} |"
    yield ""
    yield "Ours includes reading back and comparing; the others do not read back."
    yield ""


def _fleet(missed: list[str]) -> Iterator[str]:
    figures = fleet.measure()
    missed += figures.missed()
    yield f"## {figures.vehicles} vehicles on one port, state at 10 Hz, {DELAY}"
    yield ""
    yield "| | measured | required |"
    yield "|---|---|---|"
    yield f"| messages received per second | {figures.messages_hz:.0f} | – |"
    yield f"| link and fleet state, cores | {figures.cpu_share:.2f} | {fleet.MOST_CPU:g} |"
    yield f"| so many messages would fill one core, per second | {figures.messages_hz / figures.cpu_share:.0f} | – |"
    yield f"| age of the newest positions at any moment, p99, s | {figures.age_p99_s:.3f} | {fleet.OLDEST_P99_S:g} |"
    stored = f"{figures.stored}/{figures.vehicles}"
    what = f"{USUAL_ITEMS} items to each, verified ({stored}), s"
    yield f"| {what} | {figures.upload_s:.1f} | {fleet.LONGEST_UPLOAD_S:g} |"
    yield ""


def _fleets(quick: bool, missed: list[str]) -> Iterator[str]:
    yield f"## {USUAL_ITEMS} items to each of a fleet at once, real UDP, {DELAY}, loss both ways"
    yield ""
    yield "| vehicles | loss | stored and verified | s, to the last one | items per second |"
    yield "|---|---|---|---|---|"
    for n_vehicles in fleet.FLEETS[:-1] if quick else fleet.FLEETS:
        for loss in fleet.FLEET_LOSSES:
            done = fleet.measure(n_vehicles, loss, window_s=3.0)
            if done.stored < n_vehicles:
                missed.append(f"fleets: {done.stored} of {n_vehicles} missions stored at {loss:.0%} loss")
            items_s = n_vehicles * USUAL_ITEMS / done.upload_s
            yield f"| {n_vehicles} | {loss:.0%} | {done.stored}/{n_vehicles} | {done.upload_s:.1f} | {items_s:.0f} |"
    yield ""


if __name__ == "__main__":
    sys.exit(main())
