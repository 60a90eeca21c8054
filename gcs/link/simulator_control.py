"""The ground station's end of the simulator's control port: faults as lines of JSON over UDP, each answered by one."""

import asyncio
import contextlib

import msgspec

from gcs.errors import CommandRefused, LinkLost
from missions.faults import SimulatorFault, Weather

CONTROL_PORT = 14990
ATTEMPTS, PATIENCE_S = 5, 0.4


class _Answer(msgspec.Struct):
    """What the simulator says to one line."""

    ok: bool
    error: str = ""


class ControlPort:
    """Orders faults from the bundled simulator on this machine.

    Args:
        instance_base: shifts the port.
    """

    def __init__(self, instance_base: int = 0) -> None:
        self._port = CONTROL_PORT + instance_base

    async def order(self, fault: SimulatorFault, sysid: int) -> None:
        """Let something go wrong with one vehicle (with all, for the weather); a repeated order changes nothing.

        Raises:
            CommandRefused: the simulator would not.
            LinkLost: it did not answer.
        """
        if not isinstance(fault, Weather):
            fault = msgspec.structs.replace(fault, vehicle=sysid)
        loop, answers = asyncio.get_running_loop(), asyncio.Queue[bytes](16)
        transport, _ = await loop.create_datagram_endpoint(
            lambda: _Listener(answers), remote_addr=("127.0.0.1", self._port)
        )
        try:
            answer = await self._asked(transport, msgspec.json.encode(fault), answers)
        finally:
            transport.close()
        if not answer.ok:
            raise CommandRefused(f"simulator: {answer.error}")

    async def _asked(self, transport: asyncio.DatagramTransport, line: bytes, answers: asyncio.Queue[bytes]) -> _Answer:
        for _ in range(ATTEMPTS):
            transport.sendto(line)
            with contextlib.suppress(TimeoutError, msgspec.DecodeError, UnicodeDecodeError):
                async with asyncio.timeout(PATIENCE_S):
                    return msgspec.json.decode(await answers.get(), type=_Answer)
        raise LinkLost("the simulator's control port does not answer")


class _Listener(asyncio.DatagramProtocol):
    def __init__(self, answers: asyncio.Queue[bytes]) -> None:
        self._answers = answers

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        if not self._answers.full():
            self._answers.put_nowait(data)

    def error_received(self, exc: Exception) -> None:
        """Nobody is there yet: the next attempt may find somebody."""
