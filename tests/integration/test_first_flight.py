"""The first flight with the real programs: simulator, companions with MAVSDK and ground station, talking over UDP."""

import os
import signal
import socket
import subprocess
from pathlib import Path

import msgspec
import numpy as np
import pytest
from pymavlink.dialects.v20 import common

from tests.integration import programs
from tests.recordings import read_tlog

pytestmark = pytest.mark.processes


def test_the_indoor_mission_is_flown_and_its_promises_are_kept(tmp_path: Path):
    finished = programs.fly(tmp_path, "--speed", "5")
    assert finished.code == 0, finished.output
    report = programs.report_of(tmp_path)
    assert report["success"]
    assert [vehicle["landed"] and vehicle["reached"] for vehicle in report["vehicles"]] == [True, True]
    assert programs.promises_broken(tmp_path) == []
    assert (tmp_path / "flight.png").read_bytes().startswith(b"\x89PNG")
    kinds = {msgspec.json.decode(line)["kind"] for line in (tmp_path / "events.jsonl").read_text().splitlines()}
    assert kinds >= {"connected", "planned", "uploaded", "hovering", "started", "phase"}
    assert not programs.processes_of(programs.instance_base())


def test_the_recording_holds_both_directions_and_is_readable_by_other_programs(tmp_path: Path):
    finished = programs.fly(tmp_path, "--speed", "5", "--mode", "cloud")
    assert finished.code == 0, finished.output
    frames = list(read_tlog(tmp_path / "flight.tlog"))
    stamps = [stamp for stamp, _ in frames]
    assert stamps == sorted(stamps)
    reader = common.MAVLink(None)
    reader.robust_parsing = True
    sources = {
        (m.get_srcSystem(), m.get_srcComponent()) for _, f in frames for m in reader.parse_buffer(bytearray(f)) or []
    }
    assert {(255, 190), (1, 1), (2, 1)} <= sources


def held_after_s(directory: Path, fault_s: float) -> float:
    """Vehicle time from a fault to the first moment at which the autopilot was in Hold or Land, by the recording."""
    reader = common.MAVLink(None)
    reader.robust_parsing = True
    boot_s = 0.0
    for _, frame in read_tlog(directory / "flight.tlog"):
        for message in reader.parse_buffer(bytearray(frame)) or []:
            if (message.get_srcSystem(), message.get_srcComponent()) != (1, 1):
                continue
            if message.get_type() == "GLOBAL_POSITION_INT":
                boot_s = message.time_boot_ms / 1e3
            held = message.get_type() == "HEARTBEAT" and message.custom_mode in {0x03040000, 0x06040000}
            if held and boot_s > fault_s:
                return boot_s - fault_s
    raise AssertionError("never held")


def taken_over_s(directory: Path) -> float:
    """Vehicle time at which companion 1 took control, by its own log."""
    lines = [msgspec.json.decode(line) for line in (directory / "companion-1.jsonl").read_text().splitlines()]
    return next(line["t_s"] for line in lines if line["event"] == "state" and line["state"] == "ENGAGING")


SEEDED_TIMES_S = np.random.default_rng(2).uniform(0.8, 6.5, 5).round(2).tolist()


FAULTS = [(kind, at_s) for at_s in SEEDED_TIMES_S for kind in ("companion-hang", "companion-kill")]


@pytest.mark.parametrize(
    ("kind", "at_s"), [FAULTS[0], *(pytest.param(*fault, marks=pytest.mark.slow) for fault in FAULTS[1:])]
)
def test_a_companion_that_dies_or_hangs_leaves_its_vehicle_holding(tmp_path: Path, kind: str, at_s: float):
    finished = programs.fly(tmp_path, "--fault", f"{kind}:vehicle=1,at_s={at_s}")
    assert finished.code == 1, finished.output
    report = programs.report_of(tmp_path)
    assert "alpha: the companion fell silent" in report["reason"]
    alpha, bravo = report["vehicles"]
    assert (alpha["reached"], bravo["reached"]) == (False, True)
    fault_s = taken_over_s(tmp_path) + at_s
    held_s = held_after_s(tmp_path, fault_s)
    assert held_s <= 2.5
    flown = programs.truth_of(tmp_path)[1]
    heights_m = flown.positions_m[(flown.times_s >= fault_s) & (flown.times_s <= fault_s + held_s), 2]
    assert heights_m[0] - heights_m.min() <= 0.5
    assert not programs.processes_of(programs.instance_base())


def started_flight(directory: Path) -> "subprocess.Popen[str]":
    base = str(programs.instance_base())
    arguments = ("gcs", "fly", "indoor", "--sim", "--headless", "--report", str(directory), "--instance-base", base)
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    return subprocess.Popen(programs.command(*arguments), **pipes, start_new_session=True)


def wait_for_line(process: "subprocess.Popen[str]", text: str) -> None:
    assert process.stdout is not None
    lines = []
    for line in process.stdout:
        lines.append(line)
        if text in line:
            return
    raise AssertionError("".join(lines))


def test_ctrl_c_in_flight_leaves_the_vehicles_holding_and_no_process_behind(tmp_path: Path):
    process = started_flight(tmp_path)
    try:
        wait_for_line(process, "bravo: mission started")
        os.killpg(process.pid, signal.SIGINT)
        assert process.wait(timeout=20) == 130
    finally:
        programs.end(process)
    assert programs.none_left(programs.instance_base(), within_s=1.0)
    texts = (tmp_path / "events.jsonl").read_text()
    assert "Hold for all vehicles in flight" in texts


def test_when_the_ground_station_is_killed_nothing_that_it_started_survives(tmp_path: Path):
    process = started_flight(tmp_path)
    try:
        wait_for_line(process, "bravo: companion heard")
        process.send_signal(signal.SIGKILL)
    finally:
        programs.end(process)
    assert programs.none_left(programs.instance_base(), within_s=10.0)


@pytest.mark.parametrize(
    ("port", "names"), [(14550, "14550"), (18570, "18570"), (14541, "14541")], ids=["gcs", "simulator", "companion"]
)
def test_a_port_in_use_is_named_and_nothing_is_left_running(tmp_path: Path, port: int, names: str):
    base = programs.instance_base()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as occupant:
        occupant.bind(("127.0.0.1", port + base))
        finished = programs.fly(tmp_path)
    assert finished.code == 2, finished.output
    assert str(port + base) in finished.output
    assert "Traceback" not in finished.output
    assert programs.none_left(base, within_s=1.0)
