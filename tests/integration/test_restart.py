"""A ground station is killed in flight; the next one finds its way back, and commands nothing."""

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

from tests.integration import programs

SPEED = "2"
PATIENCE_S = 120.0


def started(*arguments: str) -> "subprocess.Popen[str]":
    base = ("--instance-base", str(programs.instance_base() + 60))
    return subprocess.Popen(
        programs.command(*arguments, *base), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def wait_until_flying(journal: Path, vehicles: int) -> None:
    deadline_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline_s:
        progress = [entry for entry in programs.lines_of(journal) if entry["type"] == "progressed"]
        flying = {entry["sysid"] for entry in progress if entry["phase"] == "flying"}
        if len(flying) == vehicles:
            return
        time.sleep(0.1)
    raise AssertionError(f"not flying after {PATIENCE_S:g} s: {programs.lines_of(journal)[-3:]}")


@pytest.mark.processes
def test_a_killed_ground_station_finds_back_into_the_flight_and_commands_nothing(tmp_path: Path):
    flight = ("gcs", "fly", "indoor", "--mode", "cloud", "--headless", "--speed", SPEED, "--report", str(tmp_path))
    simulator = started("sitl", "indoor", "--speed", SPEED)
    first = second = None
    try:
        first = started(*flight)
        wait_until_flying(tmp_path / "journal.jsonl", vehicles=2)
        os.kill(first.pid, signal.SIGKILL)
        first.wait()
        orders = [entry for entry in programs.lines_of(tmp_path / "audit.jsonl") if entry["type"] == "order"]
        recorded = (tmp_path / "flight.tlog").stat().st_size
        second = started(*flight)
        output = second.communicate(timeout=PATIENCE_S)[0]
    finally:
        for program in (first, second, simulator):
            if program is not None:
                programs.end(program)
    assert second.returncode == 0, output
    assert "the last ground station left alpha, bravo in flight" in output
    assert output.count("of the uploaded mission") == 2
    assert [entry for entry in programs.lines_of(tmp_path / "audit.jsonl") if entry["type"] == "order"] == orders
    assert programs.report_of(tmp_path)["success"]
    assert (tmp_path / "flight.tlog").stat().st_size > recorded
    assert programs.lines_of(tmp_path / "journal.jsonl")[-1]["type"] == "ended"
