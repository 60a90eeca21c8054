"""The cloud planner in a process of its own, so that planning never delays the links or the page."""

import asyncio
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.connection import Connection

from gcs.planner import plan_mission
from gcs.planner.plan import FleetPlan, Progress
from missions.mission import Mission

ProgressListener = Callable[[Progress], None]

_progress: Connection
"""In the worker: where progress goes."""


class PlannerProcess:
    """One worker process that plans when asked to; leaving the `with` block ends it, also in mid-plan.

    Args:
        algorithm: the planner's name.
        seed: of its random numbers.
        on_progress: called on the event loop while it plans; more may be added.
    """

    def __init__(self, algorithm: str, seed: int, on_progress: Iterable[ProgressListener] = ()) -> None:
        self._algorithm, self._seed, self.on_progress = algorithm, seed, list(on_progress)
        context = multiprocessing.get_context("spawn")
        self._receiver, self._sender = context.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(1, mp_context=context, initializer=_begin, initargs=(self._sender,))

    async def plan(self, mission: Mission) -> FleetPlan:
        """Plan for the whole fleet.

        Raises:
            MissionError: the mission cannot be planned for.
        """
        loop = asyncio.get_running_loop()
        loop.add_reader(self._receiver.fileno(), self._drain)
        try:
            return await loop.run_in_executor(self._pool, _plan, mission, self._algorithm, self._seed)
        finally:
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


def _begin(progress: Connection) -> None:
    """Set up the worker: Ctrl-C is its parent's business, and it does not outlive its parent."""
    global _progress
    _progress = progress
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


def _plan(mission: Mission, algorithm: str, seed: int) -> FleetPlan:
    return plan_mission(mission, algorithm=algorithm, seed=seed, on_progress=_progress.send)
