"""An event loop whose clock jumps to the next timer: coroutines that wait for hours run in no time, in one order."""

import asyncio
import selectors
from collections.abc import Coroutine
from typing import Any, TypeVar

T = TypeVar("T")


class NothingLeftToWaitFor(RuntimeError):
    """All coroutines wait for something that can no longer happen."""


class NobodyOutside(selectors.SelectSelector):
    """Nothing comes from outside of the process: the kernel need not be asked at every turn."""

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        return []


class VirtualTimeLoop(asyncio.SelectorEventLoop):
    """As asyncio's own loop, but time passes only when nothing is left to do now."""

    def __init__(self) -> None:
        super().__init__(NobodyOutside())
        self._now_s = 0.0

    def time(self) -> float:
        return self._now_s

    def _run_once(self) -> None:
        if not self._ready and not self._stopping:
            timers = [timer.when() for timer in self._scheduled if not timer.cancelled()]
            if not timers:
                raise NothingLeftToWaitFor
            self._now_s = max(self._now_s, min(timers))
        super()._run_once()


def run(main: Coroutine[Any, Any, T]) -> T:
    """As `asyncio.run`, on a virtual clock that begins at 0."""
    with asyncio.Runner(loop_factory=VirtualTimeLoop) as runner:
        return runner.run(main)
