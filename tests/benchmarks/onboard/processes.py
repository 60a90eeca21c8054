"""What a companion costs as a program: memory and CPU time, in the indoor flight with real processes at real time."""

import os
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tests.benchmarks.onboard.single import Part
from tests.benchmarks.planner.figures import Figure, Table, number

MOST_MB, MOST_SHARE = 150.0, 0.10
WINDOW_S = 10
"""The busiest so many seconds count ..."""
SETTLED_SHARE = 0.3
"""... after the first second in which a companion has used less than this of a core: it has loaded everything."""
LONGEST_S = 240.0
INSTANCE_BASE = 3000
HEADER = ("companion", "memory MB, highest", "CPU of a core, busiest 10 s", "CPU of a core, mean")


@dataclass
class Watched:
    """One companion, once a second."""

    cpu_s: list[float] = field(default_factory=list)
    memory_mb: list[float] = field(default_factory=list)

    @property
    def shares(self) -> np.ndarray:
        """(n,) CPU time of each second since everything was loaded."""
        shares = np.diff(self.cpu_s)
        settled = np.flatnonzero(shares < SETTLED_SHARE)
        return shares[settled[0] :] if len(settled) else shares

    @property
    def busiest(self) -> float:
        """Mean share of a core in the busiest window."""
        window = min(WINDOW_S, max(len(self.shares), 1))
        return float(np.convolve(self.shares, np.full(window, 1.0 / window), "valid").max(initial=0.0))


def processes(_seeds: range, _worlds: Iterable[str]) -> Iterator[Part]:
    """Fly once, whatever the seeds and worlds."""
    companions = watch_a_flight()
    table = Table("Companions as programs, the indoor mission at real time", HEADER)
    for name, watched in sorted(companions.items()):
        mean = float(np.mean(watched.shares)) if len(watched.shares) else np.nan
        table.rows.append((name, number(max(watched.memory_mb)), f"{watched.busiest:.1%}", f"{mean:.1%}"))
    memory_mb = max((max(watched.memory_mb) for watched in companions.values()), default=np.inf)
    busiest = max((watched.busiest for watched in companions.values()), default=np.inf)
    yield (
        table,
        [
            Figure("companion: memory", memory_mb, MOST_MB, unit="MB"),
            Figure("companion: CPU, busiest ten seconds", busiest, MOST_SHARE, unit="of a core"),
        ],
    )


def watch_a_flight() -> dict[str, Watched]:
    """Companions of one flight, by name."""
    found: dict[str, Watched] = defaultdict(Watched)
    with tempfile.TemporaryDirectory() as folder:
        fly = [sys.executable, "-m", "gcs", "fly", "indoor", "--sim", "--headless", "--speed", "1"]
        fly += ["--instance-base", str(INSTANCE_BASE), "--report", folder]
        with subprocess.Popen(fly, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as station:
            began_s = time.monotonic()
            while station.poll() is None and time.monotonic() - began_s < LONGEST_S:
                for pid in children(station.pid):
                    note(pid, found)
                time.sleep(1.0)
            station.terminate()
    return found


def children(parent: int) -> Iterator[int]:
    """Processes that a process has started, and those that they have."""
    for path in Path(f"/proc/{parent}/task").glob("*/children"):
        for pid in map(int, path.read_text().split()):
            yield pid
            yield from children(pid)


def note(pid: int, found: dict[str, Watched]) -> None:
    """Write down what a process has used, if it is a companion that still runs."""
    folder = Path(f"/proc/{pid}")
    try:
        words = folder.joinpath("cmdline").read_text().split("\0")
        used = folder.joinpath("stat").read_text().rpartition(")")[2].split()
        pages = int(folder.joinpath("statm").read_text().split()[1])
    except (FileNotFoundError, ProcessLookupError):
        return
    if "companion" in words[:3] and "--vehicle" in words:
        watched = found[f"vehicle {words[words.index('--vehicle') + 1]}"]
        watched.cpu_s.append((int(used[11]) + int(used[12])) / os.sysconf("SC_CLK_TCK"))
        watched.memory_mb.append(pages * os.sysconf("SC_PAGE_SIZE") / 1e6)
