"""A browser without a picture: it connects to a page as a real one does, says where its camera is, and counts."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import msgspec
import numpy as np
import viser
import websockets.asyncio.client
from websockets.typing import Subprotocol

from gcs.view.framing import FOV_RAD
from tests.browser.loopback import HOST

CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "fov": float(FOV_RAD),
    "near": 0.05,
    "far": 1e4,
    "image_height": 800,
    "image_width": 1200,
    "up_direction": (0.0, 0.0, 1.0),
}


class RawClient:
    """One connection.

    Args:
        connection: to the page.
        bytes_per_s: how much it reads at most.
    """

    def __init__(self, connection: websockets.asyncio.client.ClientConnection, bytes_per_s: float) -> None:
        self._connection, self._bytes_per_s = connection, bytes_per_s
        self.received = 0

    async def look(self, position_m: np.ndarray, look_at_m: np.ndarray) -> None:
        """Say where the camera is, ENU."""
        place = {"position": position_m.tolist(), "look_at": look_at_m.tolist()}
        await self._connection.send(msgspec.msgpack.encode(CAMERA | place))

    async def read(self) -> None:
        """Read until cancelled; a slow reader lets the rest wait on the wire."""
        async for message in self._connection:
            self.received += len(message)
            if np.isfinite(self._bytes_per_s):
                await asyncio.sleep(len(message) / self._bytes_per_s)


@asynccontextmanager
async def raw_client(port: int, bytes_per_s: float = np.inf) -> AsyncIterator[RawClient]:
    """Connected and reading, its camera over the south-west."""
    protocol = Subprotocol(f"viser-v{viser.__version__}")
    async with websockets.asyncio.client.connect(
        f"ws://{HOST}:{port}", subprotocols=[protocol], max_size=None, compression=None, max_queue=4
    ) as connection:
        client = RawClient(connection, bytes_per_s)
        await client.look(np.array([-20.0, -30.0, 25.0]), np.array([10.0, 7.0, 1.0]))
        reading = asyncio.create_task(client.read())
        try:
            yield client
        finally:
            reading.cancel()
            await asyncio.gather(reading, return_exceptions=True)
