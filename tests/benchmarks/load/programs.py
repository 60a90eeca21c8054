"""Simulator and ground station as processes, and what the kernel knows of them."""

import contextlib
import os
import re
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from sitl.dialect import Message, mavlink
from sitl.settings import GCS_PORT, GROUND_PORT
from tests.benchmarks.sitl.fleet_process import COMPANION_PORT, INSTANCE_BASE, ONBOARD_PORT
from tests.browser.loopback import free_port
from tests.integration.sitl_process import running_sitl

NAN = float("nan")
CLIMBING_S = 8.0
STARTING_S, ENDING_S = 20.0, 10.0
RADIUS_M, SPEED_M_S = 1.0, 1.0
"""Of the circles: pads are 3 m apart."""


@dataclass(frozen=True)
class Sockets:
    """UDP sockets of this machine, as /proc/net/udp has them."""

    waiting_bytes: int
    """Received, and not yet read."""
    drops: int
    """Datagrams for which there was no room, since the sockets were opened."""


@dataclass(frozen=True)
class Load:
    """The two programs under load.

    Args:
        simulator, station: process ids.
        vehicles: how many fly.
        folder: where the ground station keeps its recording.
    """

    simulator: int
    station: int
    vehicles: int
    folder: Path

    @property
    def station_sockets(self) -> Sockets:
        return sockets({GCS_PORT + INSTANCE_BASE})

    @property
    def simulator_sockets(self) -> Sockets:
        """Those of the ground links."""
        first = GROUND_PORT + INSTANCE_BASE
        return sockets(set(range(first, first + self.vehicles)))

    @property
    def recording(self) -> Path:
        (path,) = self.folder.rglob("flight.tlog")
        return path


def sockets(ports: set[int]) -> Sockets:
    """The UDP sockets of some local ports, added up."""
    rows = [line.split() for line in Path("/proc/net/udp").read_text(encoding="ascii").splitlines()[1:]]
    ours = [row for row in rows if int(row[1].split(":")[1], 16) in ports]
    assert len(ours) == len(ports), "not all sockets are open"
    return Sockets(sum(int(row[4].split(":")[1], 16) for row in ours), sum(int(row[-1]) for row in ours))


def resident_mb(pid: int) -> float:
    """Memory that a process occupies, libraries' code included."""
    found = re.search(r"^VmRSS:\s+(\d+) kB$", Path(f"/proc/{pid}/status").read_text(encoding="ascii"), re.MULTILINE)
    assert found is not None, f"process {pid} has ended"
    return int(found[1]) * 1024e-6


def cpu_s(pid: int) -> float:
    """CPU time of a process, all its threads."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@contextmanager
def running_load(vehicles: int, folder: Path) -> Iterator[Load]:
    """So many vehicles that fly circles, and a ground station that watches them; both end with the block.

    Raises:
        RuntimeError: the ground station does not come up.
    """
    options = ("--vehicles", str(vehicles), "--onboard-ports", f"{ONBOARD_PORT}:{COMPANION_PORT}")
    with running_sitl(*options, base=INSTANCE_BASE) as simulator, _watching(folder) as station:
        _fly_circles(vehicles)
        yield Load(simulator.pid, station.pid, vehicles, folder)


@contextmanager
def _watching(folder: Path) -> Iterator["subprocess.Popen[str]"]:
    link = f"udpin://127.0.0.1:{GCS_PORT + INSTANCE_BASE}"
    command = [sys.executable, "-m", "gcs", "watch", "--link", link, "--port", str(free_port())]
    own_folders = {name: str(folder) for name in ("XDG_STATE_HOME", "XDG_CONFIG_HOME")}
    said = folder / "watch.log"
    with said.open("w") as log:
        process = subprocess.Popen(
            command, stdout=log, stderr=subprocess.STDOUT, text=True, env=os.environ | own_folders
        )
    try:
        _until_listening(process, GCS_PORT + INSTANCE_BASE, said)
        yield process
    finally:
        process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(ENDING_S)
        process.kill()
        process.wait()


def _until_listening(process: "subprocess.Popen[str]", port: int, said: Path) -> None:
    deadline_s = time.monotonic() + STARTING_S
    while True:
        with contextlib.suppress(AssertionError):
            sockets({port})
            return
        if process.poll() is not None or time.monotonic() > deadline_s:
            raise RuntimeError(f"the ground station does not listen on UDP {port}: {said.read_text()}")
        time.sleep(0.1)


def _fly_circles(vehicles: int) -> None:
    """Arm everybody, take off, and go around where they are; answers go to the ground station that watches."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
        codec = mavlink.MAVLink(None, 254, 190)

        def order(number: int, *params: float) -> None:
            for sysid in range(1, vehicles + 1):
                message: Message = mavlink.MAVLink_command_long_message(sysid, 1, number, 0, *params)
                end.sendto(message.pack(codec), ("127.0.0.1", GROUND_PORT + INSTANCE_BASE + sysid - 1))

        time.sleep(2.0)  # they boot
        order(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1, 0, 0, 0, 0, 0, 0)
        order(mavlink.MAV_CMD_NAV_TAKEOFF, NAN, 0, 0, NAN, NAN, NAN, NAN)
        time.sleep(CLIMBING_S)
        order(mavlink.MAV_CMD_DO_ORBIT, RADIUS_M, SPEED_M_S, 0, 0, NAN, NAN, NAN)
