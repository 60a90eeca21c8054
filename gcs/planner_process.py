"""The cloud planner in a process of its own, so that planning never delays the links or the page."""

import asyncio
import ctypes
import math
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.connection import Connection
from typing import Any

from gcs.planner import ALGORITHMS, NO_FLOWN_PLAN, FlownPlan, compile_kernels, plan_mission
from gcs.planner.plan import FleetPlan, Progress
from missions.mission import Mission

ProgressListener = Callable[[Progress], None]

_progress: Connection
"""In the worker: where progress goes."""
_cancelled: Any
"""In the worker: number of the latest plan that nobody wants any more, shared with the parent."""

CANCEL_TIMEOUT_S = 1.0
DEADLINE_S = 2.0
"""Of a plan in flight: vehicles move on while it is made, and what comes late is for places that they have left."""


class PlannerProcess:
    """One worker process that plans when asked to; leaving the `with` block ends it, also in mid-plan.

    Args:
        algorithm: the planner's name; it may be changed between two plans.
        seed: of its random numbers.
        on_progress: called on the event loop while it plans; more may be added.
    """

    def __init__(self, algorithm: str, seed: int, on_progress: Iterable[ProgressListener] = ()) -> None:
        self.algorithm, self._seed, self.on_progress = algorithm, seed, list(on_progress)
        self.algorithms = ALGORITHMS
        context = multiprocessing.get_context("spawn")
        self._receiver, self._sender = context.Pipe(duplex=False)
        self._plans = 0
        self._cancelled = context.RawValue(ctypes.c_long, 0)
        work = (self._sender, self._cancelled)
        self._pool = ProcessPoolExecutor(1, mp_context=context, initializer=_begin, initargs=work)

    def prepare(self) -> None:
        """Begin to compile the planner, or to load what was compiled before, beside whatever else is being started."""
        self._pool.submit(compile_kernels)

    async def plan(self, mission: Mission, flown: FlownPlan = NO_FLOWN_PLAN, /) -> FleetPlan:
        """Plan for the whole fleet; when it is cancelled, the search is ended first.

        While something is flown, it ends in `DEADLINE_S` at the latest.

        Raises:
            MissionError: the mission cannot be planned for.
        """
        loop = asyncio.get_running_loop()
        loop.add_reader(self._receiver.fileno(), self._drain)
        self._plans += 1
        search = loop.run_in_executor(self._pool, _plan, mission, flown, self.algorithm, self._seed, self._plans)
        try:
            return await asyncio.shield(search)
        except asyncio.CancelledError:
            self._cancelled.value = self._plans
            await asyncio.wait({search}, timeout=CANCEL_TIMEOUT_S)
            raise
        finally:
            self._drain()
            loop.remove_reader(self._receiver.fileno())

    def _drain(self) -> None:
        while self._receiver.poll():
            progress = self._receiver.recv()
            for listener in self.on_progress:
                listener(progress)

    def __enter__(self) -> "PlannerProcess":
        return self

    def __exit__(self, *_: object) -> None:
        for process in multiprocessing.active_children():
            process.terminate()
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._receiver.close()
        self._sender.close()


def _begin(progress: Connection, cancelled: Any) -> None:
    """Set up the worker: Ctrl-C is its parent's business, and it does not outlive its parent."""
    global _progress, _cancelled
    _progress, _cancelled = progress, cancelled
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()


def end_with_parent() -> None:
    """Let this worker process end when the process that started it does, however that ends."""
    threading.Thread(target=_exit_after_parent, daemon=True).start()


def _exit_after_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _plan(mission: Mission, flown: FlownPlan, algorithm: str, seed: int, number: int) -> FleetPlan:
    deadline_s = time.monotonic() + (DEADLINE_S if flown.curves_m else math.inf)
    return plan_mission(
        mission,
        algorithm=algorithm,
        seed=seed,
        on_progress=_progress.send,
        should_stop=lambda: _cancelled.value >= number or time.monotonic() >= deadline_s,
        flown=flown,
    )
