"""A hundred vehicles on one port: what link and state cost, how old telemetry is, and uploads to all."""

import asyncio
import os
import time
from dataclasses import dataclass

import numpy as np

from gcs.dialect import AUTOPILOT, mavlink
from gcs.errors import GcsError
from gcs.flight import actions, upload
from gcs.link.opening import open_link
from gcs.link.url import parse_link_url
from gcs.microservices.command_client import CommandClient
from gcs.station import Station
from tests.benchmarks.link.conversation import waypoints
from tests.integration.sitl_process import free_instance_base, running_sitl

N_VEHICLES, N_ITEMS = 100, 100
RATE_HZ = 10.0
ONBOARD_PORTS = "17000:16000"
"""The usual ones leave no room for a hundred companions."""
DELAY_S = 0.05
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
    """Of the newest position of all vehicles, against the vehicles' clock; the link's delay taken off."""
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


def measure(n_vehicles: int = N_VEHICLES) -> FleetFigures:
    """The real simulator in a process of its own, over real UDP with `DELAY_S` each way."""
    base = free_instance_base()
    fault = f"link:link=ground,delay_s={DELAY_S}"
    fleet = ["--vehicles", str(n_vehicles), "--onboard-ports", ONBOARD_PORTS, "--fault", fault]
    with running_sitl(*fleet, base=base) as simulator:
        cores = os.sched_getaffinity(0)
        if len(cores) > 1:
            os.sched_setaffinity(simulator.pid, {max(cores)})
            os.sched_setaffinity(0, cores - {max(cores)})
        try:
            return asyncio.run(_measure(n_vehicles, base))
        finally:
            os.sched_setaffinity(0, cores)


async def _measure(n_vehicles: int, base: int) -> FleetFigures:
    station = Station()
    connection = await open_link(parse_link_url(f"udpin://127.0.0.1:{14550 + base}"), station.receive, lambda _: None)
    beating = asyncio.create_task(station.send_heartbeats())
    fleet = station.fleet.vehicles
    await station.wait_until(lambda: len(fleet) == n_vehicles, 30.0, "not all vehicles heard")
    await asyncio.gather(*(_request_state(station, sysid) for sysid in fleet))
    await asyncio.sleep(2.0)
    messages, cpu_s, begun_s = _received(station), time.process_time(), time.monotonic()
    ages_s = await _ages_s(station, WINDOW_S)
    took_s = time.monotonic() - begun_s
    cpu_share = (time.process_time() - cpu_s) / took_s
    messages_hz = (_received(station) - messages) / took_s
    upload_begun_s = time.monotonic()
    outcomes = await asyncio.gather(*(_store(station, sysid) for sysid in fleet))
    upload_s = time.monotonic() - upload_begun_s
    beating.cancel()
    connection.close()
    return FleetFigures(n_vehicles, messages_hz, cpu_share, float(np.percentile(ages_s, 99)), upload_s, sum(outcomes))


async def _request_state(station: Station, sysid: int) -> None:
    for message_id in (mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION):
        await station.run(CommandClient(actions.set_message_interval(message_id, RATE_HZ), (sysid, AUTOPILOT)))


async def _store(station: Station, sysid: int) -> bool:
    try:
        await upload.store(station, sysid, waypoints(N_ITEMS, np.random.default_rng(sysid)))
    except GcsError:
        return False
    return True


async def _ages_s(station: Station, window_s: float) -> list[float]:
    """Ages of all vehicles' positions at 20 Hz: how far the newest boot time lies behind the freshest clock seen."""
    offsets: dict[int, float] = {}
    samples: list[tuple[int, float]] = []
    end_s = station.now_s + window_s
    while station.now_s < end_s:
        for sysid, vehicle in station.fleet.vehicles.items():
            lag_s = station.now_s - vehicle.boot_time_s
            offsets[sysid] = min(offsets.get(sysid, lag_s), lag_s)
            samples.append((sysid, lag_s))
        await asyncio.sleep(0.05)
    return [lag_s - offsets[sysid] for sysid, lag_s in samples]


def _received(station: Station) -> int:
    return sum(source.received for source in station.codec.sources.values())
