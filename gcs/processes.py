"""Programs that the ground station starts for a flight, and ends: always, also when it is killed itself.

Each child has a session of its own, so that Ctrl-C reaches it through its parent alone, and a pipe as its standard
input: when the parent is gone, however it went, the child reads end-of-file and ends by itself (`--supervised`).
"""

import asyncio
import os
import signal
import sys
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType

from gcs.errors import ProcessFailed, UsageError

TERMINATE_TIMEOUT_S = 5.0
"""A companion that flies needs up to 2 s to leave its vehicle holding."""

LAST_LINES = 5


@dataclass
class Child:
    """One running program."""

    name: str
    process: asyncio.subprocess.Process
    last_lines: deque[str] = field(default_factory=lambda: deque(maxlen=LAST_LINES))

    @property
    def complaint(self) -> str:
        said = " | ".join(self.last_lines) or "it said nothing"
        return f"{self.name} ended with code {self.process.returncode}: {said}"


class Processes:
    """Children of this program; leaving the `async with` block ends them all.

    Args:
        log_dir: where each child's output is kept as `<name>.log`, or None.
    """

    def __init__(self, log_dir: Path | None = None) -> None:
        self._log_dir = log_dir
        self._children: list[Child] = []
        self._readers: list[asyncio.Task[None]] = []

    async def start(self, name: str, module: str, *arguments: str) -> Child:
        """Start `python -m module arguments` with this interpreter."""
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-m",
            module,
            *arguments,
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
            start_new_session=True,
        )
        child = Child(name, process)
        self._children.append(child)
        self._readers.append(asyncio.create_task(self._keep_output(child), name=f"output of {name}"))
        return child

    async def watch(self, child: Child) -> None:
        """Wait until a child ends.

        Raises:
            UsageError: it ended because of bad input (code 2), such as a port in use.
            ProcessFailed: it ended in any other way; the last lines that it said are in the message.
        """
        code = await child.process.wait()
        await asyncio.sleep(0.05)  # let its last lines arrive
        raise (UsageError if code == 2 else ProcessFailed)(child.complaint)

    async def __aenter__(self) -> "Processes":
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        # Companions first: they need the autopilots to leave their vehicles in a chosen state.
        for child in reversed(self._children):
            self._signal(child, signal.SIGTERM)
        await asyncio.shield(self._all_ended())
        for reader in self._readers:
            reader.cancel()
        await asyncio.gather(*self._readers, return_exceptions=True)

    async def _all_ended(self) -> None:
        await asyncio.gather(*(self._ended(child) for child in self._children))

    async def _ended(self, child: Child) -> None:
        try:
            async with asyncio.timeout(TERMINATE_TIMEOUT_S):
                await child.process.wait()
        except TimeoutError:
            self._signal(child, signal.SIGKILL)
            await child.process.wait()

    async def _keep_output(self, child: Child) -> None:
        assert child.process.stdout is not None
        log = (self._log_dir / f"{child.name}.log").open("wb", buffering=0) if self._log_dir else None
        try:
            async for line in child.process.stdout:
                if text := line.decode(errors="replace").strip():
                    child.last_lines.append(text)
                if log is not None:
                    log.write(line)
        finally:
            if log is not None:
                log.close()

    @staticmethod
    def _signal(child: Child, number: signal.Signals) -> None:
        if child.process.returncode is None:
            with suppress(ProcessLookupError):
                os.killpg(child.process.pid, number)
