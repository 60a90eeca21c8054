"""A whole flight of the real programs that is under way: any of them can be halted, let go on, or killed."""

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.integration import programs

MILESTONE_S = 60.0


class RunningFlight:
    """`gcs fly indoor --sim --headless`, started.

    Args:
        process: the ground station.
        directory: of its report.
        base: the shift of all ports.
    """

    def __init__(self, process: "subprocess.Popen[str]", directory: Path, base: int) -> None:
        self._process, self._directory, self._base = process, directory, base

    @property
    def station(self) -> int:
        """The ground station's process id."""
        return self._process.pid

    @property
    def simulator(self) -> int:
        return self._pid("-m sitl")

    def companion(self, sysid: int) -> int:
        return self._pid(f"-m companion --vehicle {sysid} ")

    @property
    def events(self) -> list[dict[str, Any]]:
        """What the ground station has told so far."""
        return programs.lines_of(self._directory / "events.jsonl")

    def until(self, kind: str, vehicle: str = "alpha") -> None:
        """Wait until something of a kind has happened to a vehicle."""
        deadline_s = time.monotonic() + MILESTONE_S
        while not any((event["kind"], event["vehicle"]) == (kind, vehicle) for event in self.events):
            assert self._process.poll() is None, f"ended without {kind}: {self.events[-3:]}"
            assert time.monotonic() < deadline_s, f"no {kind} within {MILESTONE_S:g} s: {self.events[-3:]}"
            time.sleep(0.02)

    def finish(self) -> programs.Finished:
        """Wait for its end."""
        output = self._process.communicate(timeout=programs.TIMEOUT_S)[0]
        return programs.Finished(self._process.returncode, output)

    def _pid(self, called: str) -> int:
        (pid,) = (pid for pid, line in programs.processes_of(self._base).items() if called in line)
        return pid


@contextmanager
def running_flight(directory: Path, *arguments: str) -> Iterator[RunningFlight]:
    """A flight that is started, and that is gone with the block, whatever has been halted in it."""
    base = programs.instance_base()
    ports = ("--instance-base", str(base))
    order = ("gcs", "fly", "indoor", "--sim", "--headless", "--report", str(directory), *ports, *arguments)
    process = subprocess.Popen(
        programs.command(*order), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    )
    try:
        yield RunningFlight(process, directory, base)
    finally:
        programs.end(process)
        for pid in programs.processes_of(base):
            os.kill(pid, signal.SIGKILL)


def halt(pid: int, lasts_s: float) -> None:
    """Let a process stand still for a while."""
    os.kill(pid, signal.SIGSTOP)
    time.sleep(lasts_s)
    os.kill(pid, signal.SIGCONT)
