"""Running the real programs in tests: started like a user starts them, always ended, and judged by what they leave."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gcs.flight.report import Flown, read_truth
from missions import obstacles
from missions.mission import load_mission

TIMEOUT_S = 240


@dataclass(frozen=True)
class Finished:
    """A program that has ended."""

    code: int
    output: str


def instance_base() -> int:
    """A shift of all ports that no other test worker uses."""
    worker = os.environ.get("PYTEST_XDIST_WORKER", "gw0")
    return 1000 + 200 * int(worker.removeprefix("gw"))


def command(*arguments: str) -> list[str]:
    """`gcs ...` with this interpreter, on ports of its own."""
    return [sys.executable, "-m", *arguments]


def run(*arguments: str, timeout_s: float = TIMEOUT_S) -> Finished:
    """Run a program to its end."""
    done = subprocess.run(command(*arguments), capture_output=True, text=True, timeout=timeout_s, check=False)
    return Finished(done.returncode, done.stdout + done.stderr)


def fly(report: Path, *arguments: str) -> Finished:
    """`gcs fly indoor --sim --headless` with a report."""
    ports = ("--instance-base", str(instance_base()))
    return run("gcs", "fly", "indoor", "--sim", "--headless", "--report", str(report), *ports, *arguments)


def report_of(directory: Path) -> dict[str, Any]:
    return json.loads((directory / "report.json").read_text())


def truth_of(directory: Path) -> dict[int, Flown]:
    return read_truth(directory / "truth.csv")


def promises_broken(directory: Path, name: str = "indoor", *, broken_off: Collection[str] = ()) -> list[str]:
    """What the first flight promises, judged from the truth log alone; a sentence for each broken promise.

    Of vehicles whose flight was broken off no arrival is promised.
    """
    mission = load_mission(name)
    solid, broken = obstacles.pack(mission.world), []
    flown = {sysid: part.in_flight() for sysid, part in truth_of(directory).items()}
    targets = {target.name: target.position_m for target in mission.targets}
    assert mission.allocation is not None
    for vehicle in mission.vehicles:
        part = flown[vehicle.sysid]
        clearance_m = obstacles.clearance(part.positions_m, solid)
        speed_m_s = np.linalg.norm(part.velocities_m_s, axis=1)
        near_m_s = speed_m_s[clearance_m < 1.0].max(initial=0.0)
        target_m = np.array(targets[mission.allocation[vehicle.name]])
        missed_m = float(np.linalg.norm((part.positions_m[-1] - target_m)[:2]))
        checks = [
            (clearance_m.min() >= 0.3, f"clearance {clearance_m.min():.2f} m"),
            (speed_m_s.max() <= 3.0, f"speed {speed_m_s.max():.2f} m/s"),
            (near_m_s <= 1.2, f"speed {near_m_s:.2f} m/s near an obstacle"),
            (missed_m <= 0.5 or vehicle.name in broken_off, f"landed {missed_m:.2f} m from its target"),
            (part.positions_m[-1][2] < 0.1, f"ended {part.positions_m[-1][2]:.2f} m above the ground"),
        ]
        broken += [f"{vehicle.name}: {what}" for kept, what in checks if not kept]
    separation_m = report_of(directory)["min_separation_m"]
    return broken if separation_m >= 0.6 else [*broken, f"separation {separation_m:.2f} m"]


def processes_of(base: int) -> dict[int, str]:
    """Process ids and command lines of simulators and companions on these ports that are still alive."""
    found: dict[int, str] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                line = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode()
            except OSError:
                continue
            if f"--instance-base {base} " in f"{line} " and ("-m sitl" in line or "-m companion" in line):
                found[int(entry.name)] = line
    return found


def none_left(base: int, within_s: float) -> bool:
    """Whether all simulators and companions on these ports end within a time."""
    deadline_s = time.monotonic() + within_s
    while processes_of(base):
        if time.monotonic() > deadline_s:
            return False
        time.sleep(0.1)
    return True


def lines_of(path: Path) -> list[dict[str, Any]]:
    """The whole lines of a JSON-lines file; none before it is there."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_bytes().splitlines(keepends=True) if line.endswith(b"\n")]


def end(process: "subprocess.Popen[str]") -> None:
    """Make sure that a program and what it has started is gone."""
    if process.poll() is None:
        process.send_signal(signal.SIGKILL)
    process.wait()
    if process.stdout is not None:
        process.stdout.close()
