"""The fleet link's socket on loopback, and the URLs that name it."""

import socket
import time

import pytest

from companion.errors import UsageError
from companion.link.fleet_port import FleetPort, parse_fleet_link


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def heard(port: FleetPort) -> list[bytes]:
    """What arrives within a second."""
    for _ in range(100):
        if found := list(port.poll()):
            return found
        time.sleep(0.01)
    return []


@pytest.mark.parametrize("url", ["mcast://239.255.145.50:{}/127.0.0.1", "udpbcast://127.255.255.255:{}"])
def test_companions_of_one_machine_hear_each_other_without_a_relay(url: str):
    address = parse_fleet_link(url.format(free_port()))
    with FleetPort(address, 0) as one, FleetPort(address, 0) as other:
        one.send(b"here")
        assert heard(other) == [b"here"]


def test_a_relay_is_spoken_to_from_the_vehicles_own_port():
    own = free_port()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as relay:
        relay.bind(("127.0.0.1", 0))
        relay.settimeout(2.0)
        with FleetPort(parse_fleet_link(f"udpout://127.0.0.1:{relay.getsockname()[1]}"), own) as port:
            port.send(b"here")
            assert relay.recvfrom(100) == (b"here", ("127.0.0.1", own))
            relay.sendto(b"there", ("127.0.0.1", own))
            assert heard(port) == [b"there"]


def test_without_anybody_there_speaking_does_no_harm():
    with FleetPort(parse_fleet_link(f"udpout://127.0.0.1:{free_port()}"), free_port()) as port:
        for _ in range(5):
            port.send(b"here")
            assert list(port.poll()) == []


def test_a_port_in_use_is_named():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        own = taken.getsockname()[1]
        with pytest.raises(UsageError, match=f"fleet link 127.0.0.1:{own}: address already in use"):
            FleetPort(parse_fleet_link("udpout://127.0.0.1:14980"), own)


@pytest.mark.parametrize(
    "url", ["", "14980", "udpin://127.0.0.1:14980", "udpout://127.0.0.1", "mcast://group:14700", "mcast://239.1.1.1:0"]
)
def test_urls_that_are_none_are_refused_with_examples(url: str):
    with pytest.raises(UsageError, match=r"mcast://239.255.145.50:14700"):
        parse_fleet_link(url)
