"""Each program of a flight stands still for a while (SIGSTOP, SIGCONT) or is killed, at drawn moments of real flights.

One seed of each test runs always, the others in `make test-all`; seeds take turns with the phases of a flight.
"""

import os
import signal
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from pymavlink.dialects.v20 import common

from tests.integration import programs
from tests.integration.companion_process import HOLD, LAND, OFFBOARD
from tests.integration.running_flight import RunningFlight, halt, running_flight
from tests.recordings import read_tlog

pytestmark = pytest.mark.processes

PHASES = {"connected": (0.0, 1.0), "uploaded": (0.0, 9.0), "started": (0.0, 16.0)}
"""What a phase begins with, and from when to when after it something is done [vehicle time]: connecting and uploading;
the take-off; from the start of the missions over cruise and arrival to the landing."""
IN_CONTROL = {"started": (0.8, 7.0)}
"""When companions certainly have control."""
MOMENT_S, WHILE_S, LONG_S = (0.1, 0.3), (0.3, 1.8), (4.0, 20.0)
"""A dead-man ends its companion after 0.5 s; companions take an autopilot for lost after 3 s."""
HELD_WITHIN_S = 2.5
AT_REST_AFTER_S, STANDS_WITHIN_M = 6.0, 0.3
"""From the first heartbeat in Hold: it was seen to swing by up to 0.9 m and to be at rest after 5 s [vehicle time]."""
ARMED = common.MAV_MODE_FLAG_SAFETY_ARMED


class Halt(NamedTuple):
    """When a process is halted, and for how long [wall clock]."""

    begins_with: str
    after_s: float
    lasts_s: float

    def wait(self, flight: RunningFlight) -> None:
        """Until its time has come."""
        flight.until(self.begins_with)
        time.sleep(self.after_s)


def drawn(
    seed: int, lasts_s: tuple[float, float], speed: float, phases: dict[str, tuple[float, float]] = PHASES
) -> Halt:
    """A halt in the phase whose turn it is."""
    rng = np.random.default_rng(seed)
    begins_with, window_s = list(phases.items())[seed % len(phases)]
    return Halt(begins_with, rng.uniform(*window_s) / speed, rng.uniform(*lasts_s))


def seeds(always: int | None, count: int = 6) -> list[Any]:
    """So many seeds, all but one of them for `make test-all` alone."""
    return [seed if seed == always else pytest.param(seed, marks=pytest.mark.slow) for seed in range(count)]


def orders_by(origin: str, directory: Path) -> list[str]:
    """What was ordered in somebody's name."""
    lines = programs.lines_of(directory / "audit.jsonl")
    return [line["order"] for line in lines if line["type"] == "order" and line["origin"] == origin]


def assert_like_any_other(directory: Path, finished: programs.Finished) -> None:
    """Everybody has arrived, in the report and in truth, and nothing was ordered that the flight does not need."""
    assert finished.code == 0, finished.output
    assert "Traceback" not in finished.output
    vehicles = programs.report_of(directory)["vehicles"]
    assert [vehicle["reached"] and vehicle["landed"] for vehicle in vehicles] == [True, True]
    assert programs.promises_broken(directory) == []
    assert orders_by("monitor", directory) == []
    assert programs.none_left(programs.instance_base(), within_s=1.0)


def fly_with_halted_station(directory: Path, stop: Halt, speed: float) -> programs.Finished:
    with running_flight(directory, "--speed", f"{speed:g}") as flight:
        stop.wait(flight)
        halt(flight.station, stop.lasts_s)
        return flight.finish()


@pytest.mark.parametrize("seed", seeds(None))
def test_a_ground_station_that_stands_still_for_a_while_changes_nothing(tmp_path: Path, seed: int):
    finished = fly_with_halted_station(tmp_path, drawn(seed, WHILE_S, speed=2.0), speed=2.0)
    assert_like_any_other(tmp_path, finished)


@pytest.mark.parametrize("seed", seeds(2))
def test_a_ground_station_that_stands_still_for_long_finds_its_vehicles_where_they_are(tmp_path: Path, seed: int):
    finished = fly_with_halted_station(tmp_path, drawn(seed, LONG_S, speed=5.0), speed=5.0)
    assert_like_any_other(tmp_path, finished)


@pytest.mark.parametrize("seed", seeds(2))
def test_a_simulator_that_stands_still_for_a_while_delays_a_flight_and_changes_nothing_else(tmp_path: Path, seed: int):
    stop = drawn(seed, WHILE_S, speed=5.0)
    with running_flight(tmp_path, "--speed", "5") as flight:
        stop.wait(flight)
        halt(flight.simulator, stop.lasts_s)
        finished = flight.finish()
    assert_like_any_other(tmp_path, finished)


@pytest.mark.parametrize("seed", seeds(None))
def test_while_autopilots_are_silent_for_long_nobody_arrives_and_who_lost_them_says_so(tmp_path: Path, seed: int):
    stop = drawn(seed, LONG_S, speed=2.0)
    with running_flight(tmp_path, "--speed", "2") as flight:
        stop.wait(flight)
        before, pid = flight.events, flight.simulator
        halt(pid, stop.lasts_s)
        told = flight.events[len(before) :]
        finished = flight.finish()
    assert "Traceback" not in finished.output
    assert not any(event["kind"] == "phase" for event in told), told
    report = programs.report_of(tmp_path)
    broken_off = [vehicle["name"] for vehicle in report["vehicles"] if not vehicle["reached"]]
    assert finished.code == bool(broken_off), finished.output
    assert all(vehicle["reason"] for vehicle in report["vehicles"])
    assert programs.promises_broken(tmp_path, broken_off=broken_off) == []
    assert programs.none_left(programs.instance_base(), within_s=1.0)


@pytest.mark.parametrize("seed", seeds(2))
def test_a_killed_simulator_ends_the_flight_with_a_reason_and_leaves_no_process(tmp_path: Path, seed: int):
    stop = drawn(seed, WHILE_S, speed=5.0, phases=PHASES | {"started": (0.0, 12.0)})
    with running_flight(tmp_path, "--speed", "5") as flight:
        stop.wait(flight)
        os.kill(flight.simulator, signal.SIGKILL)
        killed_s = time.monotonic()
        finished = flight.finish()
    assert time.monotonic() - killed_s < 20.0
    assert finished.code == 1, finished.output
    assert "Traceback" not in finished.output
    report = programs.report_of(tmp_path)
    assert report["reason"].startswith("sitl ended with code -9")
    assert not report["success"]
    assert not any(vehicle["reached"] for vehicle in report["vehicles"])
    assert programs.none_left(programs.instance_base(), within_s=1.0)


@pytest.mark.parametrize("seed", seeds(None))
def test_a_companion_that_stands_still_for_less_than_its_dead_man_flies_on(tmp_path: Path, seed: int):
    stop = drawn(seed, MOMENT_S, speed=2.0)
    with running_flight(tmp_path, "--speed", "2") as flight:
        stop.wait(flight)
        halt(flight.companion(1), stop.lasts_s)
        finished = flight.finish()
    assert_like_any_other(tmp_path, finished)


@pytest.mark.parametrize("seed", seeds(None))
def test_a_companion_that_stands_still_before_it_flies_only_delays_the_flight(tmp_path: Path, seed: int):
    on_the_way_up = {"connected": (0.0, 1.0), "uploaded": (0.0, 7.0)}
    stop = drawn(seed, (0.6, 6.0), speed=2.0, phases=on_the_way_up)
    with running_flight(tmp_path, "--speed", "2") as flight:
        stop.wait(flight)
        halt(flight.companion(1), stop.lasts_s)
        finished = flight.finish()
    assert_like_any_other(tmp_path, finished)


class Mode(NamedTuple):
    """What an armed autopilot said to be in; disarmed, it goes back to the mode that was chosen before."""

    after_s: float
    """Wall clock, since what was done."""
    boot_s: float
    """Vehicle time."""
    number: int


def modes_since(directory: Path, unix_us: int) -> list[Mode]:
    """What autopilot 1 has said of its mode since then, by the recording."""
    reader = common.MAVLink(None)
    reader.robust_parsing = True
    boot_s, modes = 0.0, list[Mode]()
    for stamp_us, frame in read_tlog(directory / "flight.tlog"):
        for message in reader.parse_buffer(bytearray(frame)) or []:
            if (message.get_srcSystem(), message.get_srcComponent()) != (1, 1):
                continue
            if message.get_type() == "GLOBAL_POSITION_INT":
                boot_s = message.time_boot_ms / 1e3
            elif message.get_type() == "HEARTBEAT" and stamp_us >= unix_us and message.base_mode & ARMED:
                modes.append(Mode((stamp_us - unix_us) / 1e6, boot_s, message.custom_mode))
    return modes


@pytest.mark.parametrize("seed", seeds(0))
def test_a_companion_that_stands_still_in_control_is_over_and_its_vehicle_holds_for_good(tmp_path: Path, seed: int):
    stop = drawn(seed, (0.7, 6.0), speed=2.0, phases=IN_CONTROL)
    with running_flight(tmp_path, "--speed", "2") as flight:
        stop.wait(flight)
        pid, halted_us = flight.companion(1), time.time_ns() // 1000
        halt(pid, stop.lasts_s)
        finished = flight.finish()
    assert finished.code == 1, finished.output
    assert f"companion-1 ended with code {-signal.SIGALRM}" in finished.output
    alpha, bravo = programs.report_of(tmp_path)["vehicles"]
    assert (alpha["reached"], alpha["reason"], bravo["reached"]) == (False, "the companion fell silent", True)
    assert programs.promises_broken(tmp_path, broken_off=["alpha"]) == []
    modes = modes_since(tmp_path, halted_us)
    held = next(mode for mode in modes if mode.number in {HOLD, LAND})
    assert held.after_s <= HELD_WITHIN_S
    assert OFFBOARD not in [mode.number for mode in modes if mode.boot_s >= held.boot_s]
    flown = programs.truth_of(tmp_path)[1]
    places_m = flown.positions_m[flown.times_s >= held.boot_s + AT_REST_AFTER_S, :2]
    assert np.linalg.norm(places_m - places_m[0], axis=1).max() <= STANDS_WITHIN_M
    assert programs.none_left(programs.instance_base(), within_s=1.0)
