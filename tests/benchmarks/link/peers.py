"""The same upload by this ground station, MAVSDK and MAVProxy, over real UDP to the real simulator with a lossy link.

All three store the same mission, each trial on a simulator of its own.
"""

import asyncio
import tempfile
import time
from collections.abc import Awaitable, Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gcs.errors import GcsError
from gcs.flight import upload
from gcs.link.opening import open_link
from gcs.link.url import parse_link_url
from gcs.station import Station
from missions.mission_items import MissionItem
from tests.benchmarks.link.conditions import LOSSES, ONE_WAY_DELAY_S, USUAL_ITEMS, waypoints
from tests.integration.mavproxy_session import running_mavproxy
from tests.integration.sitl_process import free_instance_base, running_sitl

LONGEST_S = 60.0
MOST_LOSS = 0.3
"""Beyond it the others store nothing at all."""
CONNECT_S = 15.0


@dataclass(frozen=True)
class Attempt:
    """One upload by one client."""

    seconds: float
    """Until the client said that it was done, or gave up."""
    says_stored: bool


@dataclass(frozen=True)
class PeerRow:
    """All attempts of one client at one loss."""

    client: str
    loss: float
    attempts: tuple[Attempt, ...]

    @property
    def stored(self) -> int:
        return sum(attempt.says_stored for attempt in self.attempts)


Client = Callable[[int, Sequence[MissionItem]], Awaitable[Attempt]]


async def ours(base: int, items: Sequence[MissionItem]) -> Attempt:
    """This ground station; its time includes reading back and comparing."""
    station = Station()
    connection = await open_link(parse_link_url(f"udpin://127.0.0.1:{14550 + base}"), station.receive, lambda _: None)
    beating = asyncio.create_task(station.send_heartbeats())
    try:
        await station.wait_until(lambda: 1 in station.fleet.vehicles, CONNECT_S, "no vehicle")
        await asyncio.sleep(2.5)
        begun_s = time.monotonic()
        try:
            async with asyncio.timeout(LONGEST_S):
                await upload.store(station, 1, items)
        except (GcsError, TimeoutError):
            return Attempt(time.monotonic() - begun_s, says_stored=False)
        return Attempt(time.monotonic() - begun_s, says_stored=True)
    finally:
        beating.cancel()
        connection.close()


async def mavsdk(base: int, items: Sequence[MissionItem]) -> Attempt:
    """MAVSDK's raw mission upload."""
    from mavsdk.asyncio.mavsdk import Configuration, Mavsdk
    from mavsdk.asyncio.plugins.mission_raw import MissionItem as RawItem
    from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync

    library = Mavsdk(Configuration.create_manual(255, 190, True))
    try:
        await library.add_any_connection(f"udpin://127.0.0.1:{14550 + base}")
        raw = MissionRawAsync(await library.first_autopilot(CONNECT_S))
        rows = [
            RawItem(seq, i.frame, i.command, int(seq == 0), 1, i.param1, i.param2, i.param3, i.param4, i.x, i.y, i.z, 0)
            for seq, i in enumerate(items)
        ]
        begun_s, stored = time.monotonic(), False
        with suppress(Exception):  # its own result types; a time-out among them
            async with asyncio.timeout(LONGEST_S):
                await raw.upload_mission(rows)
                stored = True
        return Attempt(time.monotonic() - begun_s, stored)
    finally:
        library.destroy()


async def mavproxy(base: int, items: Sequence[MissionItem]) -> Attempt:
    """MAVProxy's `wp load`."""
    return await asyncio.to_thread(_mavproxy, base, items)


def _mavproxy(base: int, items: Sequence[MissionItem]) -> Attempt:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "plan.txt").write_text(_waypoint_file(items))
        with running_mavproxy(14550 + base, folder) as session:
            session.answer(r"Detected vehicle|online system", CONNECT_S)
            time.sleep(3.0)
            begun_s = time.monotonic()
            try:
                session.ask("wp load plan.txt", r"Sent all \d+ waypoints[\s\S]*TYPE_MISSION: ACCEPTED", LONGEST_S)
            except AssertionError:
                return Attempt(time.monotonic() - begun_s, says_stored=False)
            return Attempt(time.monotonic() - begun_s, says_stored=True)


def _waypoint_file(items: Sequence[MissionItem]) -> str:
    rows = (
        f"{seq}\t{int(seq == 0)}\t0\t{i.command}\t{i.param1}\t{i.param2}\t{i.param3}\t{i.param4}"
        f"\t{i.x / 1e7:.7f}\t{i.y / 1e7:.7f}\t{i.z:.6f}\t1\n"
        for seq, i in enumerate(items)
    )
    return "QGC WPL 110\n" + "".join(rows)


CLIENTS: dict[str, Client] = {"this ground station": ours, "MAVSDK": mavsdk, "MAVProxy": mavproxy}


def compare(n_trials: int) -> Iterator[PeerRow]:
    """Yield the rows of all clients at all losses, each trial on a simulator of its own."""
    for loss in [loss for loss in LOSSES if loss <= MOST_LOSS]:
        for name, client in CLIENTS.items():
            attempts = tuple(_attempt(client, loss, seed) for seed in range(n_trials))
            yield PeerRow(name, loss, attempts)


def _attempt(client: Client, loss: float, seed: int) -> Attempt:
    base = free_instance_base()
    items = waypoints(USUAL_ITEMS, np.random.default_rng(seed))
    fault = f"link:link=ground,loss={loss},delay_s={ONE_WAY_DELAY_S}"
    with running_sitl("--vehicles", "1", "--seed", str(seed), "--fault", fault, base=base):
        return asyncio.run(client(base, items))
