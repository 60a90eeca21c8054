"""A hundred vehicles on one port: what link and state cost, how old telemetry is, and uploads to all."""

import asyncio
import subprocess
import sys
import time
from dataclasses import dataclass

import numpy as np

from gcs.errors import GcsError
from gcs.flight import upload
from gcs.link.opening import open_link
from gcs.link.url import parse_link_url
from gcs.station import Station
from tests.benchmarks.link.conditions import USUAL_ITEMS, waypoints
from tests.integration.sitl_process import free_instance_base

N_VEHICLES = 100
FLEETS, FLEET_LOSSES = (1, 10, 100), (0.0, 0.1)
GCS_PORT, FIRST_PORT = 14550, 18570
WINDOW_S = 10.0
MOST_CPU, LONGEST_UPLOAD_S, OLDEST_P99_S = 1.0, 20.0, 0.3


@dataclass(frozen=True)
class FleetFigures:
    """What was measured."""

    vehicles: int
    messages_hz: float
    cpu_share: float
    """Of one core."""
    age_p99_s: float
    """Of the newest position of every vehicle, at any moment; they come every 0.1 s."""
    upload_s: float
    stored: int

    def missed(self) -> list[str]:
        """A sentence for every required figure that is not met."""
        out: list[str] = []
        if self.cpu_share > MOST_CPU:
            out.append(f"fleet: {self.cpu_share:.2f} cores, at most {MOST_CPU:g}")
        if self.age_p99_s > OLDEST_P99_S:
            out.append(f"fleet: telemetry {self.age_p99_s:.2f} s old (p99), at most {OLDEST_P99_S:g} s")
        if self.upload_s > LONGEST_UPLOAD_S:
            out.append(f"fleet: uploads took {self.upload_s:.1f} s, at most {LONGEST_UPLOAD_S:g} s")
        if self.stored < self.vehicles:
            out.append(f"fleet: {self.stored} of {self.vehicles} missions stored")
        return out


def measure(n_vehicles: int = N_VEHICLES, loss: float = 0.0, window_s: float = WINDOW_S) -> FleetFigures:
    """The light fleet in a process of its own, over real UDP with 50 ms each way.

    Args:
        n_vehicles: in the fleet.
        loss: share of frames that get lost, both ways.
        window_s: how long is listened before the uploads begin.
    """
    base = free_instance_base()
    arguments = [str(n_vehicles), str(FIRST_PORT + base), str(GCS_PORT + base), str(loss)]
    command = [sys.executable, "-m", "tests.benchmarks.link.light_fleet", *arguments]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as vehicles:
        assert vehicles.stdin is not None
        assert vehicles.stdout is not None
        try:
            line = vehicles.stdout.readline()
            if line != "ready\n":
                raise RuntimeError(f"expected the light fleet to be ready, it said {line!r}")
            return asyncio.run(_measure(n_vehicles, base, window_s))
        finally:
            vehicles.stdin.close()


async def _measure(n_vehicles: int, base: int, window_s: float) -> FleetFigures:
    station = Station()
    url = parse_link_url(f"udpin://127.0.0.1:{GCS_PORT + base}")
    connection = await open_link(url, station.receive, lambda _: None)
    beating = asyncio.create_task(station.send_heartbeats())
    fleet = station.fleet.vehicles
    await station.wait_until(lambda: len(fleet) == n_vehicles, 30.0, "not all vehicles heard")
    await asyncio.sleep(2.0)
    messages, cpu_s, begun_s = _received(station), time.process_time(), time.monotonic()
    ages_s = await _ages_s(station, window_s)
    took_s = time.monotonic() - begun_s
    cpu_share = (time.process_time() - cpu_s) / took_s
    messages_hz = (_received(station) - messages) / took_s
    upload_begun_s = time.monotonic()
    outcomes = await asyncio.gather(*(_store(station, sysid) for sysid in fleet))
    upload_s = time.monotonic() - upload_begun_s
    beating.cancel()
    connection.close()
    return FleetFigures(n_vehicles, messages_hz, cpu_share, float(np.percentile(ages_s, 99)), upload_s, sum(outcomes))


async def _store(station: Station, sysid: int) -> bool:
    try:
        await upload.store(station, sysid, waypoints(USUAL_ITEMS, np.random.default_rng(sysid)))
    except GcsError:
        return False
    return True


async def _ages_s(station: Station, window_s: float) -> list[float]:
    """How old the newest position of each vehicle is, 50 times a second; both ends read the same clock."""
    ages_s: list[float] = []
    end_s = station.now_s + window_s
    while station.now_s < end_s:
        ages_s += [station.now_s - vehicle.boot_time_s for vehicle in station.fleet.vehicles.values()]
        await asyncio.sleep(0.02)
    return ages_s


def _received(station: Station) -> int:
    return sum(source.received for source in station.codec.sources.values())
