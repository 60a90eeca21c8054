"""Faults ordered from the bundled simulator over its control port."""

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

import pytest

from gcs.errors import CommandRefused, LinkLost
from gcs.link import simulator_control
from gcs.link.simulator_control import CONTROL_PORT, ControlPort
from missions.faults import LinkFault, Weather


class Simulator(asyncio.DatagramProtocol):
    """Answers as it is told to; None is silence."""

    def __init__(self, answer: Callable[[dict], dict | None]) -> None:
        self.answer, self.heard = answer, list[dict]()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = transport

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        self.heard.append(json.loads(data))
        said = self.answer(self.heard[-1])
        if said is not None:
            self.transport.sendto(json.dumps(said).encode(), addr)  # type: ignore[attr-defined]


@asynccontextmanager
async def simulator(answer: Callable[[dict], dict | None]) -> AsyncIterator[tuple[Simulator, ControlPort]]:
    transport, protocol = await asyncio.get_running_loop().create_datagram_endpoint(
        lambda: Simulator(answer), local_addr=("127.0.0.1", 0)
    )
    try:
        yield protocol, ControlPort(transport.get_extra_info("sockname")[1] - CONTROL_PORT)
    finally:
        transport.close()


async def test_a_fault_names_its_vehicle_and_the_weather_is_everybodys():
    async with simulator(lambda _: {"ok": True, "time_s": 1.0}) as (heard, port):
        await port.order(LinkFault(loss=0.3), 2)
        await port.order(Weather(east_m_s=4.0), 2)
    assert (heard.heard[0]["type"], heard.heard[0]["vehicle"], heard.heard[0]["loss"]) == ("link", 2, 0.3)
    assert "vehicle" not in heard.heard[1]


async def test_what_the_simulator_will_not_do_is_told_in_its_words():
    async with simulator(lambda _: {"ok": False, "error": "fault: vehicle: found 9"}) as (_, port):
        with pytest.raises(CommandRefused, match="found 9"):
            await port.order(LinkFault(), 9)


async def test_an_order_is_repeated_until_it_is_answered(monkeypatch):
    monkeypatch.setattr(simulator_control, "PATIENCE_S", 0.05)
    lines = iter([None, None, {"ok": True}])
    async with simulator(lambda _: next(lines)) as (heard, port):
        await port.order(LinkFault(), 1)
    assert len(heard.heard) == 3


async def test_a_simulator_that_is_not_there_is_noticed(monkeypatch):
    monkeypatch.setattr(simulator_control, "PATIENCE_S", 0.02)
    async with simulator(lambda _: None) as (heard, port):
        with pytest.raises(LinkLost, match="does not answer"):
            await port.order(LinkFault(), 1)
    assert len(heard.heard) == simulator_control.ATTEMPTS
