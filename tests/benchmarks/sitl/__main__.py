"""The command line of the simulator's benchmark; see the package."""

import argparse
import os
import platform
import statistics
import sys
from pathlib import Path

from rich.console import Console

from sitl.simulator import Simulator
from tests.benchmarks.planner.figures import Figure, Results, Table, number
from tests.benchmarks.sitl.fleet_process import FleetRun, Memory, Window, running_fleet
from tests.benchmarks.sitl.in_process import boot_s, speeds_in_flight

FLEET = 100
WINDOWS = 5
STARTS = 5
MOST_CPU_S, MOST_MB, SLOWEST, LONGEST_BOOT_S = 0.01, 2.0, 50.0, 1.0
REAL_TIME = 0.98
FEWEST_MESSAGES_HZ = 240.0
"""Per vehicle, both links: the default streams are 253 a second."""


def main() -> int:
    """0 if every required figure is met, 1 if not."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.sitl", description=__doc__)
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the tables there, too")
    given = parser.parse_args()
    results = Results(Console(width=None if sys.stdout.isatty() else 160))
    results.console.print(f"{_machine()}, load {os.getloadavg()[0]:.1f} at the start", highlight=False)
    Simulator(1, seed=1).step()
    starts, alone = _starts()
    results.add(*_one_vehicle(starts))
    with running_fleet(FLEET) as fleet:
        results.add(*_fleet(fleet, alone))
    return results.conclude(given.markdown)


def _starts() -> tuple[list[float], Memory]:
    """How long the program with one vehicle takes until it is ready [s], and what it then has in memory."""
    starts: list[float] = []
    while True:
        with running_fleet(1) as single:
            starts.append(single.ready_after_s)
            if len(starts) == STARTS:
                return starts, single.memory


def _one_vehicle(starts: list[float]) -> tuple[Table, list[Figure]]:
    boot, speeds = boot_s(), list(speeds_in_flight())
    rows = [
        (
            "start of the program until it is ready, s",
            number(statistics.median(starts)),
            f"{min(starts):.2f} to {max(starts):.2f}",
        ),
        ("boot until it may arm, simulated s", number(boot), ""),
        (
            "hovering, simulated s per CPU s",
            number(statistics.median(speeds)),
            f"{min(speeds):.0f} to {max(speeds):.0f}",
        ),
    ]
    figures = [
        Figure("boot until a vehicle may arm", boot, LONGEST_BOOT_S),
        Figure("one vehicle in process", statistics.median(speeds), SLOWEST, at_least=True, unit="times real time"),
    ]
    return Table("one vehicle in process", ("", "median", "range"), rows), figures


def _fleet(fleet: FleetRun, alone: Memory) -> tuple[Table, list[Figure]]:
    standing = [fleet.measure() for _ in range(WINDOWS)]
    fleet.take_off(FLEET)
    flying = [fleet.measure() for _ in range(WINDOWS)]
    memory = fleet.memory
    further_mb = (memory.resident_mb - alone.resident_mb) / (FLEET - 1)
    rows = [_row("standing", standing), _row("hovering", flying)]
    title = (
        f"{FLEET} vehicles, one process on one core, all telemetry received; ready {fleet.ready_after_s:.1f} s after "
        f"its start; {memory.resident_mb:.0f} MB resident, {memory.own_mb:.0f} MB of it data; with one vehicle "
        f"{alone.resident_mb:.0f} and {alone.own_mb:.0f} MB"
    )
    header = (
        "",
        "CPU s per simulated s and vehicle",
        "range",
        "simulated s per s",
        "range",
        "messages per s and vehicle",
    )
    return Table(title, header, rows), [
        Figure("CPU per simulated second and vehicle, hovering", _cpu(flying), MOST_CPU_S),
        Figure("CPU per simulated second and vehicle, standing", _cpu(standing), MOST_CPU_S),
        Figure("pace on one core, hovering", _pace(flying), REAL_TIME, at_least=True, unit="of real time"),
        Figure("pace on one core, standing", _pace(standing), REAL_TIME, at_least=True, unit="of real time"),
        Figure("telemetry per vehicle, hovering", _messages_hz(flying), FEWEST_MESSAGES_HZ, at_least=True, unit="Hz"),
        Figure("resident memory of the whole process per vehicle", memory.resident_mb / FLEET, MOST_MB, unit="MB"),
        Figure("resident memory per further vehicle", further_mb, MOST_MB, unit="MB"),
    ]


def _row(name: str, windows: list[Window]) -> tuple[str, ...]:
    costs, paces = [_cost(window) for window in windows], [_speed(window) for window in windows]
    return (
        name,
        number(_cpu(windows)),
        f"{min(costs):.4f} to {max(costs):.4f}",
        f"{_pace(windows):.3f}",
        f"{min(paces):.3f} to {max(paces):.3f}",
        number(_messages_hz(windows)),
    )


def _cost(window: Window) -> float:
    """CPU seconds per simulated second and vehicle."""
    return window.cpu_s / window.simulated_s / FLEET


def _cpu(windows: list[Window]) -> float:
    return statistics.median(_cost(window) for window in windows)


def _speed(window: Window) -> float:
    """Simulated seconds per second of the wall clock."""
    return window.simulated_s / window.wall_s


def _pace(windows: list[Window]) -> float:
    return statistics.median(_speed(window) for window in windows)


def _messages_hz(windows: list[Window]) -> float:
    return sum(window.messages for window in windows) / sum(window.simulated_s for window in windows) / FLEET


def _machine() -> str:
    models = [
        line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if "model name" in line
    ]
    return f"Python {platform.python_version()}, {os.cpu_count()} cores, {models[0] if models else platform.machine()}"


if __name__ == "__main__":
    sys.exit(main())
