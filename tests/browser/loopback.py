"""Ports for pages under test."""

import asyncio
import contextlib
import socket

HOST = "127.0.0.1"
PATIENCE_S = 60.0
"""A page drawn in software on a busy machine comes slowly."""


def free_port() -> int:
    with socket.create_server((HOST, 0)) as listener:
        return listener.getsockname()[1]


async def answering(port: int) -> None:
    """Wait until something listens on a port."""
    async with asyncio.timeout(PATIENCE_S):
        while True:
            with contextlib.suppress(OSError):
                _, writer = await asyncio.open_connection(HOST, port)
                writer.close()
                return
            await asyncio.sleep(0.02)
