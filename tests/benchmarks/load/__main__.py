"""The command line of the load benchmark; see the package."""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from tests.benchmarks.command_line import machine
from tests.benchmarks.load.programs import Load, cpu_s, resident_mb, running_load
from tests.benchmarks.load.recorded import Heard, heard
from tests.benchmarks.planner.figures import Figure, Results, Table, number

FLEET = 100
WARM_UP_S = 60.0
LOOK_INTERVAL_S = 0.5
MOST_GROWTH_MB_MIN = {"simulator": 0.5, "ground station": 6.0}
"""A trail takes 56 bytes for each position, 10 a second from each vehicle: 3.4 MB in a minute."""
MOST_WAITING_BYTES = 1 << 20
"""A quarter of the receive buffer."""
OLDEST_P99_S = 0.3
REAL_TIME = 0.98
ROWS = 10


@dataclass(frozen=True)
class Look:
    """At both programs, at one moment."""

    time_s: float
    simulator_mb: float
    station_mb: float
    waiting_bytes: int


def main() -> int:
    """0 if every required figure is met, 1 if not."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.load", description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0, help="after the warm-up of a minute")
    parser.add_argument("--vehicles", type=int, default=FLEET, help="in the air")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the tables there, too")
    given = parser.parse_args()
    results = Results(Console(width=None if sys.stdout.isatty() else 160))
    results.note(machine())
    with tempfile.TemporaryDirectory() as folder, running_load(given.vehicles, Path(folder)) as load:
        time.sleep(WARM_UP_S)
        since_us, began_s = time.time_ns() // 1000, time.monotonic()
        drops, cpu = _drops(load), _cpu(load)
        looks = _looks(load, 60.0 * given.minutes)
        lasted_s = time.monotonic() - began_s
        dropped = _drops(load) - drops
        shares = [(after - before) / lasted_s for before, after in zip(cpu, _cpu(load), strict=True)]
        results.add(*_memory(looks, shares))
        results.add(*_traffic(looks, dropped, heard(load.recording, since_us), given.vehicles))
    return results.conclude(given.markdown)


def _looks(load: Load, duration_s: float) -> list[Look]:
    began_s, looks = time.monotonic(), list[Look]()
    while (time_s := time.monotonic() - began_s) < duration_s:
        waiting = load.station_sockets.waiting_bytes
        looks.append(Look(time_s, resident_mb(load.simulator), resident_mb(load.station), waiting))
        time.sleep(LOOK_INTERVAL_S)
    return looks


def _drops(load: Load) -> int:
    return load.station_sockets.drops + load.simulator_sockets.drops


def _cpu(load: Load) -> tuple[float, float]:
    return cpu_s(load.simulator), cpu_s(load.station)


def growth_mb_min(looks: list[Look], memory_mb: Callable[[Look], float]) -> float:
    """The slope of the straight line through all looks."""
    slope = np.polyfit([look.time_s for look in looks], [memory_mb(look) for look in looks], 1)[0]
    return 60.0 * float(slope)


def _memory(looks: list[Look], shares: list[float]) -> tuple[Table, list[Figure]]:
    shown = [looks[round(i)] for i in np.linspace(0, len(looks) - 1, ROWS)]
    rows: list[tuple[str, ...]] = []
    figures: list[Figure] = []
    of: dict[str, Callable[[Look], float]] = {
        "simulator": lambda look: look.simulator_mb,
        "ground station": lambda look: look.station_mb,
    }
    for (name, memory_mb), share in zip(of.items(), shares, strict=True):
        growth = growth_mb_min(looks, memory_mb)
        rows.append((name, *(f"{memory_mb(look):.0f}" for look in shown), f"{growth:.2f}", f"{share:.2f}"))
        figures.append(Figure(f"growth of the {name}", growth, MOST_GROWTH_MB_MIN[name], unit="MB per minute"))
    header = ("MB resident after, s", *(f"{look.time_s:.0f}" for look in shown), "MB per minute", "cores")
    return Table("memory, after a minute of warm-up", header, rows), figures


def _traffic(looks: list[Look], dropped: int, found: Heard, vehicles: int) -> tuple[Table, list[Figure]]:
    waiting = [look.waiting_bytes for look in looks]
    rows = [
        ("messages received per second", number(found.messages_hz)),
        ("vehicles heard to the end", str(found.vehicles)),
        ("datagrams dropped, both ways", str(dropped)),
        ("waiting in the station's socket, kB: median", number(float(np.median(waiting)) / 1e3)),
        ("most", number(max(waiting) / 1e3)),
        ("age of a newest position when the next one comes, s: 99 %", number(found.age_p99_s)),
        ("most", number(found.age_max_s)),
        ("pace of the simulator, of real time", f"{found.pace:.3f}"),
    ]
    figures = [
        Figure("vehicles heard to the end", found.vehicles, vehicles, at_least=True, unit=""),
        Figure("datagrams dropped", dropped, 0.0, unit=""),
        Figure("waiting in the station's socket", max(waiting) / 1e3, MOST_WAITING_BYTES / 1e3, unit="kB"),
        Figure("age of positions, 99 %", found.age_p99_s, OLDEST_P99_S),
        Figure("pace of the simulator", found.pace, REAL_TIME, at_least=True, unit="of real time"),
    ]
    return Table(f"{vehicles} vehicles flying circles, telemetry over UDP", ("", ""), rows), figures


if __name__ == "__main__":
    sys.exit(main())
