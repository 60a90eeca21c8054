"""Runs a simulation on sockets until it is told to end: by a signal, or by the end of standard input."""

import asyncio
import contextlib
import signal
import sys
from collections.abc import Coroutine
from typing import Any

from sitl.errors import NoStandardInput
from sitl.link.control_port import ControlPort
from sitl.link.memory_files import MemoryFiles
from sitl.link.truth_log import TruthLog
from sitl.link.udp import FleetLinks, run
from sitl.settings import Settings
from sitl.simulator import Simulator


async def serve(simulator: Simulator, settings: Settings, files: MemoryFiles | None) -> None:
    """Open the links, say so, and simulate; keep changed parameters if there are files for them.

    Raises:
        PortInUse: a port is taken.
        NoStandardInput: it shall be supervised, and there is no pipe to watch.
        OSError: the truth log or a parameter file cannot be written.
    """
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    if settings.supervised:
        await _watch_standard_input(stop)
    links, control = FleetLinks(simulator, settings), ControlPort(simulator, settings)
    with TruthLog(settings.truth) if settings.truth else contextlib.nullcontext() as log:
        links.open()
        try:
            control.open()
            _say_ready(simulator, settings)
            await _until(stop, run(simulator, links, settings, log, files))
        finally:
            control.close()
            links.close()


async def _until(stop: asyncio.Event, work: Coroutine[Any, Any, None]) -> None:
    """Run a coroutine until it fails or `stop` is set."""
    async with asyncio.TaskGroup() as group:
        task = group.create_task(work)
        waiting = group.create_task(stop.wait())
        await asyncio.wait((task, waiting), return_when=asyncio.FIRST_COMPLETED)
        task.cancel()
        waiting.cancel()


async def _watch_standard_input(stop: asyncio.Event) -> None:
    """Set `stop` when standard input ends."""

    class Watch(asyncio.Protocol):
        def eof_received(self) -> None:
            stop.set()

        def connection_lost(self, exc: Exception | None) -> None:
            stop.set()

    try:
        await asyncio.get_running_loop().connect_read_pipe(Watch, sys.stdin)
    except ValueError:
        raise NoStandardInput from None


def _say_ready(simulator: Simulator, settings: Settings) -> None:
    """One line for whoever started us."""
    sysids = ", ".join(str(sysid) for sysid in simulator.vehicles)
    base = f", instance base {settings.instance_base}" if settings.instance_base else ""
    run_as = f"speed {settings.speed:g}, seed {settings.seed}{base}"
    print(f"sitl: ready, {simulator.mission.name}, vehicles {sysids}, {run_as}", flush=True)
