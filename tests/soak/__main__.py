"""`make soak SEEDS=N [SEED0=M]`: fly N seeds, fail if an invariant is violated; `--replay SEED` shows one flight."""

import argparse
import sys
from pathlib import Path

from rich.console import Console

from gcs.experiments.command import Order, conduct
from gcs.flight.picture import draw_flight
from tests.soak.experiment import SOAK, fly
from tests.soak.scenario import draw

MOST_PICTURES = 5
"""Of so many flights that broke an invariant the events and the picture are shown at once."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100, metavar="N", help="how many flights")
    parser.add_argument("--seed0", type=int, default=0, metavar="M", help="the first seed")
    parser.add_argument("--replay", type=int, metavar="SEED", help="one flight, with its events and its picture")
    parser.add_argument("--output", type=Path, default=Path("out/soak"))
    options = parser.parse_args()
    console = Console(highlight=False, soft_wrap=True)
    if options.replay is not None:
        return replay(options.replay, options.output, console)
    again = f"make soak SEEDS={options.seeds} SEED0={options.seed0}"
    rows = conduct(SOAK, Order("soak", options.seeds, options.seed0, None, options.output), console, again)
    broken = [row for row in rows if row["violations"]]
    for row in broken:
        console.print(f"seed {row['seed']}: {row['violations']}", markup=False)
        console.print(f"  again: .venv/bin/python -m tests.soak --replay {row['seed']}", markup=False)
    console.print(f"{len(rows)} flights, {sum(bool(row['success']) for row in rows)} arrived, {len(broken)} violations")
    for row in broken[:MOST_PICTURES]:
        replay(int(str(row["seed"])), options.output, console)  # what raised raises again, and is seen where
    return 1 if broken else 0


def replay(seed: int, output: Path, console: Console) -> int:
    """Fly one seed again; its events are printed and its picture is drawn."""
    scenario = draw(seed)
    console.print(scenario.story, markup=False)
    system, _, row = fly(scenario, seed)
    for event in system.events.events:
        console.print(f"{event.t_s:8.2f} {event.vehicle or '':8} {event.kind:12} {event.text}", markup=False)
    for crash in system.simulator.collisions:
        console.print(str(crash), markup=False)
    output.mkdir(parents=True, exist_ok=True)
    picture = output / f"seed-{seed}.png"
    tracks = {vehicle.name: system.flown()[vehicle.sysid].positions_m for vehicle in scenario.mission.vehicles}
    draw_flight(picture, scenario.truth, system.flight.plan, tracks)
    console.print(f"{row['reason']}\nfingerprint {row['fingerprint']}\n{picture}", markup=False)
    console.print(f"violations: {row['violations'] or 'none'}", markup=False)
    return 1 if row["violations"] else 0


if __name__ == "__main__":
    sys.exit(main())
