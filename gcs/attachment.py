"""A ground station for one job on the command line: links opened, vehicles heard, everything closed again."""

import asyncio
import contextlib
from collections.abc import AsyncGenerator, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager

from gcs.errors import UsageError
from gcs.folders import orders_file
from gcs.link.opening import open_link
from gcs.link.url import LinkUrl
from gcs.security.audit import Audit, AuditFile, Origin, acting_as
from gcs.security.key_ring import KeyRing
from gcs.station import Station

HEARD_TIMEOUT_S = 15.0
OTHERS_S = 1.2
"""After the first vehicle; heartbeats come every second."""


@asynccontextmanager
async def attached(
    links: Sequence[LinkUrl], ring: KeyRing, say: Callable[[str], None], *, audited: bool = True
) -> AsyncGenerator[Station]:
    """A station on some links until the block ends; what is sent in it are the operator's orders.

    Args:
        links: what is opened.
        ring: keys of the vehicles.
        say: takes sentences about the links.
        audited: orders are noted beside the recordings of flights, where all that was not given in a flight stands.

    Raises:
        UsageError: a link cannot be opened, or the keys cannot be used.
    """
    station = Station(say=say)
    station.codec.signing = ring.signing(station.unix_us, say)
    async with AsyncExitStack() as stack:
        if audited:
            audit = _audit_file(say)
            stack.callback(audit.close)
            station.audit = Audit(audit.write, station.unix_us)
        for link in links:
            connection = await open_link(link, station.receive, station.tell)
            stack.callback(connection.close)
            station.connections.append(connection)
        heartbeats = asyncio.create_task(station.send_heartbeats())
        stack.push_async_callback(_cancelled, heartbeats)
        stack.enter_context(acting_as(Origin.OPERATOR))
        yield station


async def heard_vehicle(station: Station, sysid: int | None) -> int:
    """Wait for a vehicle, or for whichever is there, and only that one; its system id.

    Raises:
        LinkLost: it was not heard.
        UsageError: several vehicles are heard, and none was named.
    """
    fleet = station.fleet.vehicles
    if sysid is not None:
        await station.wait_until(lambda: sysid in fleet, HEARD_TIMEOUT_S, f"vehicle {sysid} not heard")
        return sysid
    await station.wait_until(lambda: bool(fleet), HEARD_TIMEOUT_S, "no vehicle heard")
    await asyncio.sleep(OTHERS_S)
    if len(fleet) > 1:
        raise UsageError(f"vehicles {', '.join(map(str, sorted(fleet)))} are heard: name one with --vehicle")
    return next(iter(fleet))


def _audit_file(say: Callable[[str], None]) -> AuditFile:
    path = orders_file()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return AuditFile(path, say)
    except OSError as problem:
        raise UsageError(f"{path}: orders cannot be noted: {problem.strerror}") from None


async def _cancelled(task: "asyncio.Task[None]") -> None:
    task.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await task
