"""The real program behind a page under test."""

import asyncio
import contextlib
import signal
import sys
from collections.abc import AsyncIterator


@contextlib.asynccontextmanager
async def gcs_fly(*options: str) -> AsyncIterator[asyncio.subprocess.Process]:
    """`gcs fly` with these options; Ctrl-C at the end."""
    command = [sys.executable, "-m", "gcs", "fly", *options]
    process = await asyncio.create_subprocess_exec(*command)
    try:
        yield process
    finally:
        if process.returncode is None:
            process.send_signal(signal.SIGINT)
            await asyncio.wait_for(process.wait(), 30.0)
