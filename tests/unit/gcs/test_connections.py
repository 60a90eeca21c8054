"""Real sockets and a pseudo-terminal: connections come, go, and come again; budgets are kept."""

import asyncio
import itertools
import os
import pty
import socket
from collections.abc import Callable

import pytest

from gcs.dialect import mavlink
from gcs.errors import UsageError
from gcs.link import retries, streams
from gcs.link.connection import OpenConnection
from gcs.link.frames import FrameSplitter
from gcs.link.opening import open_link
from gcs.link.retries import Retries
from gcs.link.shaper import LONGEST_WAIT_S, Shaper, Urgency, fitting_rates
from gcs.link.url import LinkUrl, Scheme, parse_link_url
from tests.unit.gcs.messages import frame_of

HEARTBEAT = mavlink.MAVLink_heartbeat_message(2, 12, 81, 0, 3, 3)
FRAMES = [frame_of(1, 1, HEARTBEAT, seq) for seq in range(3)]
ADDRESS = ("127.0.0.1", 1)


class Ground:
    """What a connection hands over."""

    def __init__(self) -> None:
        self.frames: list[bytes] = []
        self.addresses: list[tuple[str, int]] = []
        self.said: list[str] = []

    def take(self, connection: object, frame: bytes, address: tuple[str, int]) -> None:
        self.frames.append(frame)
        self.addresses.append(address)

    async def open(self, text: str) -> OpenConnection:
        return await open_link(parse_link_url(text), self.take, self.said.append)


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(5.0):
        while not condition():  # noqa: ASYNC110 - what is waited for has no event
            await asyncio.sleep(0.005)


def free_port(kind: int = socket.SOCK_STREAM) -> int:
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture(autouse=True)
def short_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(retries, "FIRST_PAUSE_S", 0.01)


# ------------------------------------------------------------------ connection strings


@pytest.mark.parametrize("grammar", ["{}://{}:{}", "{}:{}:{}"])
@pytest.mark.parametrize("scheme", ["udpin", "udpout", "tcp", "tcpin"])
def test_both_grammars_name_all_connections(grammar: str, scheme: str):
    assert parse_link_url(grammar.format(scheme, "10.0.0.7", 5760)) == LinkUrl(Scheme(scheme), "10.0.0.7", 5760)


def test_a_serial_line_has_a_device_a_baud_rate_and_so_a_budget():
    url = parse_link_url("serial:///dev/ttyUSB0:57600")
    assert (url.scheme, url.host, url.port, url.budget_bytes_s) == (Scheme.SERIAL, "/dev/ttyUSB0", 57600, 4608.0)
    assert parse_link_url("serial:/dev/ttyUSB0:57600") == url
    assert parse_link_url("serial:///dev/ttyUSB0:57600?bytes_s=1000").budget_bytes_s == 1000.0
    assert parse_link_url("udpin://:14550?bytes_s=2500").budget_bytes_s == 2500.0


@pytest.mark.parametrize(
    "text", ["tcp://h", "serial:///dev/x", "tcp://h:70000", "udpin://h:1?bytes_s=0", "udpin://h:1?x=1"]
)
def test_what_cannot_be_is_refused(text: str):
    with pytest.raises(UsageError, match="expected one of"):
        parse_link_url(text)


# ------------------------------------------------------------------ streams


def test_frames_are_found_in_a_stream_however_it_is_cut():
    stream = b"\x00garbage\xfd" + b"".join(FRAMES) + b"\xfe\x01"
    for size in (1, 2, 7, 300):
        splitter, found = FrameSplitter(), []
        for at in range(0, len(stream), size):
            found += splitter.feed(stream[at : at + size])
        assert found == FRAMES


def test_a_damaged_frame_does_not_take_the_next_one_with_it():
    damaged = bytearray(FRAMES[0])
    damaged[12] ^= 1
    assert FrameSplitter().feed(bytes(damaged) + FRAMES[1] + FRAMES[2]) == FRAMES[1:]


def test_noise_that_looks_like_an_unknown_message_takes_no_true_frame_with_it():
    noise = bytes([0xFD, 30, 0, 0, 0, 9, 9]) + (12_345_678).to_bytes(3, "little")
    assert FrameSplitter().feed(noise + b"".join(FRAMES)) == FRAMES
    unknown = noise + bytes(32)
    assert FrameSplitter().feed(unknown + FRAMES[0] + unknown) == [unknown, FRAMES[0], unknown]


def test_mavlink_1_is_not_looked_for_in_a_stream():
    sender = mavlink.MAVLink(None, 1, 1)
    splitter = FrameSplitter()
    assert splitter.feed(bytes(HEARTBEAT.pack(sender, force_mavlink1=True)) + FRAMES[0] + b"\xfe" * 1000) == FRAMES[:1]
    assert splitter.skipped_bytes == 1017


def test_a_connection_that_does_not_hold_is_tried_ever_later_and_a_good_one_soon_again():
    tries = Retries()
    assert [tries.take() for _ in range(12)][-1] == retries.LONGEST_PAUSE_S
    tries.held(0.1)
    assert not tries.is_first
    tries.held(60.0)
    assert tries.is_first
    assert tries.take() == retries.FIRST_PAUSE_S


async def test_a_tcp_client_connects_as_soon_as_there_is_a_server_and_again_when_it_is_lost():
    ground, vehicle, port = Ground(), Ground(), free_port()
    client = await ground.open(f"tcp://127.0.0.1:{port}")
    await until(lambda: any("trying again" in text for text in ground.said))
    for round_number in range(2):
        server = await vehicle.open(f"tcpin://127.0.0.1:{port}")
        await until(lambda number=round_number: sum("connected" in text for text in ground.said) == number + 1)
        client.send(FRAMES[0], client.peer or ADDRESS)
        await until(lambda number=round_number: len(vehicle.frames) == number + 1)
        server.send(FRAMES[1], vehicle.addresses[-1])
        await until(lambda number=round_number: len(ground.frames) == number + 1)
        server.close()
        await until(lambda number=round_number: sum("lost" in text for text in ground.said) == number + 1)
    client.close()
    assert vehicle.frames == [FRAMES[0]] * 2
    assert ground.frames == [FRAMES[1]] * 2


async def test_a_tcp_server_keeps_its_clients_apart():
    ground, port = Ground(), free_port()
    server = await ground.open(f"tcpin://127.0.0.1:{port}")
    ends = [Ground(), Ground()]
    clients = [await end.open(f"tcp:127.0.0.1:{port}") for end in ends]
    await until(lambda: sum("has connected" in text for text in ground.said) == 2)
    clients[1].send(FRAMES[0], ADDRESS)
    await until(lambda: len(ground.frames) == 1)
    server.send(FRAMES[2], ground.addresses[0])
    await until(lambda: len(ends[1].frames) == 1)
    assert ends[0].frames == []
    for connection in (*clients, server):
        connection.close()


async def test_who_only_keeps_a_place_makes_room_for_the_next_tcp_client(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(streams, "MOST_CLIENTS", 2)
    monkeypatch.setattr(streams, "IDLE_S", 0.2)
    ground, port = Ground(), free_port()
    server = await ground.open(f"tcpin://127.0.0.1:{port}")
    ends = [await asyncio.open_connection("127.0.0.1", port) for _ in range(2)]
    refused, closing = await asyncio.open_connection("127.0.0.1", port)
    assert await refused.read(1) == b""
    await asyncio.sleep(0.3)
    ends[1][1].write(FRAMES[0])
    await until(lambda: len(ground.frames) == 1)
    ends.append(await asyncio.open_connection("127.0.0.1", port))
    ends[2][1].write(FRAMES[1])
    await until(lambda: len(ground.frames) == 2)
    assert await ends[0][0].read(1) == b""
    server.close()
    for writer in [closing, *(end[1] for end in ends)]:
        writer.close()


async def test_a_flood_of_datagrams_leaves_everything_else_its_turn():
    ground, port, loop = Ground(), free_port(socket.SOCK_DGRAM), asyncio.get_running_loop()
    inward = await ground.open(f"udpin://127.0.0.1:{port}")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as flood:
        for size in [60_000] * 20 + [0] * 3000:
            flood.sendto(bytes(size), ("127.0.0.1", port))
    taken: list[int] = []
    while len(ground.frames) < 3020:
        taken.append(len(ground.frames))
        turn = loop.create_future()
        loop.call_soon(turn.set_result, None)
        await turn
    inward.close()
    assert max(later - earlier for earlier, later in itertools.pairwise(taken)) < 700
    assert taken[1] < 20
    assert max(map(len, ground.frames)) == 4096


async def test_a_taken_port_is_named():
    ground, port = Ground(), free_port(socket.SOCK_DGRAM)
    first = await ground.open(f"udpin://127.0.0.1:{port}")
    with pytest.raises(UsageError, match=f"cannot bind UDP 127.0.0.1:{port}"):
        await ground.open(f"udpin://127.0.0.1:{port}")
    first.close()


async def test_udp_goes_both_ways_and_survives_a_peer_that_is_gone():
    ground, vehicle, port = Ground(), Ground(), free_port(socket.SOCK_DGRAM)
    out = await vehicle.open(f"udpout://127.0.0.1:{port}")
    out.send(FRAMES[0], out.peer or ADDRESS)  # nobody there: ICMP comes back
    inward = await ground.open(f"udpin:127.0.0.1:{port}")
    out.send(FRAMES[0], out.peer or ADDRESS)
    await until(lambda: len(ground.frames) == 1)
    inward.send(FRAMES[1], ground.addresses[0])
    await until(lambda: vehicle.frames == [FRAMES[1]])
    out.close()
    inward.close()


async def test_a_serial_line_carries_frames_and_is_opened_again_after_it_was_unplugged(tmp_path):
    device, ground = tmp_path / "radio", Ground()
    master, slave = pty.openpty()
    device.symlink_to(os.ttyname(slave))
    line = await ground.open(f"serial://{device}:57600")
    await until(lambda: any("open" in text for text in ground.said))
    os.write(master, FRAMES[0][:5])
    os.write(master, FRAMES[0][5:] + FRAMES[1])
    await until(lambda: ground.frames == FRAMES[:2])
    line.send(FRAMES[2], ADDRESS)
    assert os.read(master, 100) == FRAMES[2]
    os.close(slave)
    os.close(master)
    await until(lambda: any("gone" in text for text in ground.said))
    master, slave = pty.openpty()
    device.unlink()
    device.symlink_to(os.ttyname(slave))
    await until(lambda: sum(text.endswith(": open") for text in ground.said) == 2)
    os.write(master, FRAMES[0])
    await until(lambda: len(ground.frames) == 3)
    line.close()
    await asyncio.sleep(0.01)
    os.close(slave)
    os.close(master)


# ------------------------------------------------------------------ budgets


def test_a_budget_is_kept_and_urgent_frames_go_first():
    shaper, frame = Shaper(1000.0), bytes(50)
    sent_bytes, now_s, first_control_s = 0, 0.0, None
    for _ in range(30):
        sent_bytes += sum(len(f) for f, _ in shaper.offer(frame, ADDRESS, Urgency.BULK, now_s))
    out = shaper.offer(b"urgent", ADDRESS, Urgency.CONTROL, now_s)
    while shaper.wait_s is not None:
        if b"urgent" in [f for f, _ in out] and first_control_s is None:
            first_control_s = now_s
        now_s += shaper.wait_s
        out = shaper.due(now_s)
        sent_bytes += sum(len(f) for f, _ in out)
    assert first_control_s is not None
    assert first_control_s < 0.1
    assert sent_bytes / (now_s + 0.35) <= 1000.0
    assert now_s < 1.6


def test_what_would_wait_too_long_is_dropped_and_counted():
    shaper = Shaper(1000.0)
    for _ in range(100):
        shaper.offer(bytes(50), ADDRESS, Urgency.BULK, 0.0)
    assert shaper.dropped > 100 - LONGEST_WAIT_S * 1000.0 / 50 - 10


def test_without_a_budget_everything_goes_at_once():
    shaper = Shaper(None)
    assert shaper.offer(b"x", ADDRESS, Urgency.BULK, 0.0) == [(b"x", ADDRESS)]
    assert shaper.wait_s is None


def test_telemetry_rates_of_all_vehicles_fit_into_the_budget():
    wanted, size = {33: 10.0, 31: 10.0}, {33: 40, 31: 44}
    assert fitting_rates(wanted, size, 3, None) == wanted
    assert fitting_rates(wanted, size, 1, 100_000.0) == wanted
    fitting = fitting_rates(wanted, size, 10, 2000.0)
    assert sum(10 * rate * size[number] for number, rate in fitting.items()) == pytest.approx(1400.0)
