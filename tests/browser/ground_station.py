"""The real programs behind a page under test."""

import asyncio
import contextlib
import signal
import sys
from collections.abc import AsyncIterator


@contextlib.asynccontextmanager
async def program(module: str, *arguments: str) -> AsyncIterator[asyncio.subprocess.Process]:
    """`python -m module` with these arguments; Ctrl-C at the end."""
    process = await asyncio.create_subprocess_exec(sys.executable, "-m", module, *arguments)
    try:
        yield process
    finally:
        if process.returncode is None:
            process.send_signal(signal.SIGINT)
            await asyncio.wait_for(process.wait(), 30.0)


def gcs_fly(*options: str) -> contextlib.AbstractAsyncContextManager[asyncio.subprocess.Process]:
    """`gcs fly` with these options; Ctrl-C at the end."""
    return program("gcs", "fly", *options)
