"""The experimenter's way in while a simulation runs: faults as lines of JSON in UDP datagrams, each line answered."""

import asyncio
import contextlib
import socket

import msgspec

from missions.errors import MissionError
from missions.faults import decode_simulator_fault
from sitl.link.udp import LARGEST_DATAGRAM_BYTES, bind
from sitl.settings import CONTROL_PORT, Settings
from sitl.simulator import Simulator

MOST_LINES = 100
"""Of one datagram; what comes after them is left out."""


class Answer(msgspec.Struct, frozen=True, omit_defaults=True):
    """What becomes of one line."""

    ok: bool
    time_s: float
    """Simulated time."""
    error: str = ""


class ControlPort:
    """One socket, on loopback, for orders to the simulation.

    Args:
        simulator: who obeys.
        settings: host and instance base.
    """

    def __init__(self, simulator: Simulator, settings: Settings) -> None:
        self._simulator = simulator
        self._settings = settings
        self._socket: socket.socket | None = None

    def open(self) -> None:
        """Bind the port, and receive on it in the running event loop.

        Raises:
            PortInUse: naming the port.
        """
        self._socket = bind(self._settings.host, CONTROL_PORT + self._settings.instance_base, "control")
        asyncio.get_running_loop().add_reader(self._socket, self._receive, self._socket)

    def close(self) -> None:
        if self._socket is not None:
            asyncio.get_running_loop().remove_reader(self._socket)
            self._socket.close()
            self._socket = None

    def _receive(self, end: socket.socket) -> None:
        with contextlib.suppress(OSError):
            datagram, sender = end.recvfrom(LARGEST_DATAGRAM_BYTES)
            end.sendto(obey(self._simulator, datagram), sender)


def obey(simulator: Simulator, datagram: bytes) -> bytes:
    """Carry out a datagram line by line, up to a hundred; one line of answer for each, whatever is in it."""
    lines = [line for line in datagram.split(b"\n", MOST_LINES)[:MOST_LINES] if line.strip()]
    return b"".join(msgspec.json.encode(_answer(simulator, line)) + b"\n" for line in lines)


def _answer(simulator: Simulator, line: bytes) -> Answer:
    try:
        simulator.order(decode_simulator_fault(line))
    except MissionError as refused:
        return Answer(ok=False, time_s=simulator.time_s, error=str(refused))
    return Answer(ok=True, time_s=simulator.time_s)
