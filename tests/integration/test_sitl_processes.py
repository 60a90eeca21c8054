"""The `sitl` program: starts, says so, takes no port from others, and leaves nothing behind."""

import hashlib
import json
import os
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from missions.lidar_packets import unpack
from missions.ports import RADIO_PORT, companion_port, fleet_port, onboard_port
from sitl.dialect import mavlink
from tests.integration.sitl_process import SITL, GroundStation, free_instance_base, is_free, running_sitl

pytestmark = pytest.mark.processes


@pytest.fixture
def base() -> int:
    return free_instance_base()


@pytest.fixture
def ground(base) -> Iterator[GroundStation]:
    station = GroundStation(base)
    yield station
    station.close()


def test_it_sends_at_once_to_all_its_peers_and_obeys(base, ground):
    with running_sitl("--vehicles", "2", "--speed", "5", base=base):
        ground.until(lambda: ground.last("HEARTBEAT", 1) and ground.last("HEARTBEAT", 2))
        ground.until(lambda: ground.last("HEARTBEAT", 2).system_status == 3)
        ground.send(mavlink.MAVLink_command_long_message(2, 1, 400, 0, 1, *[0] * 6), sysid=2)
        ack = ground.until(lambda: ground.last("COMMAND_ACK", 2))
        assert (ack.command, ack.result) == (400, 0)
        ground.until(lambda: ground.last("HEARTBEAT", 2).base_mode & 128)
        assert not ground.last("HEARTBEAT", 1).base_mode & 128


def test_simulated_time_passes_at_the_ordered_speed(base, ground):
    with running_sitl("--vehicles", "1", "--speed", "4", base=base):
        first = ground.until(lambda: ground.last("ATTITUDE")).time_boot_ms
        begin_s = time.monotonic()
        ground.until(lambda: ground.last("ATTITUDE").time_boot_ms > first + 6000)
        assert time.monotonic() - begin_s == pytest.approx(1.5, abs=0.4)


def test_no_scipy_is_loaded_into_it(base):
    """It would be a tenth of the program's memory, for a BLAS that no kernel calls."""
    with running_sitl("--vehicles", "1", base=base) as process:
        mapped = Path(f"/proc/{process.pid}/maps").read_text()
    assert "llvmlite" in mapped
    assert "cython_blas" not in mapped


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_it_cleanly(base, number):
    with running_sitl("--vehicles", "1", base=base) as process:
        process.send_signal(number)
        assert process.wait(10.0) == 0
        assert process.stderr.read() == ""


def test_a_supervised_simulator_ends_with_its_parent(base):
    with running_sitl("--vehicles", "1", base=base) as process:
        process.stdin.close()
        assert process.wait(10.0) == 0


def test_a_port_in_use_is_named(base):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 14580 + base + 1))
        command = [str(SITL), "--vehicles", "3", "--instance-base", str(base)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=200)
    assert done.returncode == 2
    assert f"127.0.0.1:{14580 + base + 1} (onboard link of vehicle 2) is in use" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ((), "expected a MISSION or --vehicles"),
        (("indoor", "--vehicles", "2"), "expected a MISSION or --vehicles"),
        (("no-such-mission",), "no shipped mission of that name"),
        (("indoor", "--origin", "north pole"), "--origin north pole: expected LAT,LON,ALT"),
        (("indoor", "--origin", "95,0,0"), "--origin 95,0,0: expected LAT,LON,ALT"),
        (("indoor", "--speed", "0"), "--speed"),
        (("--vehicles", "0"), "--vehicles"),
        (("indoor", "--airframe", "zeppelin"), "--airframe"),
        (("indoor", "--fault", "lightning:vehicle=1"), "--fault lightning:vehicle=1: Invalid value 'lightning'"),
        (("indoor", "--fault", "reboot:vehicle=3"), "expected one of 1, 2, found 3"),
        (("indoor", "--signing-key", "/no/such/keys"), "/no/such/keys"),
        (("indoor", "--signing-key", __file__), "expected 64 hexadecimal digits"),
        (("indoor", "--parameters", __file__), "File exists"),
        (("indoor", "--truth", "/no/such/folder/truth.csv"), "/no/such/folder/truth.csv"),
    ],
)
def test_bad_usage_is_explained(base, arguments, complaint):
    command = [str(SITL), *arguments, "--instance-base", str(base)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=200, stdin=subprocess.DEVNULL)
    assert done.returncode == 2
    assert complaint in done.stderr.replace("\n", " ")
    assert "Traceback" not in done.stderr


def test_the_truth_survives_a_kill(base, tmp_path):
    path = tmp_path / "truth.csv"
    with running_sitl("indoor", "--speed", "5", "--truth", str(path), base=base) as process:
        time.sleep(1.0)
        os.kill(process.pid, signal.SIGKILL)
        process.wait(10.0)
    lines = path.read_text().splitlines()
    assert lines[0] == "t_s,sysid,east_m,north_m,up_m,ve_m_s,vn_m_s,vu_m_s"
    assert float(lines[-2].split(",")[0]) > 3.0


def test_a_mission_is_moved_to_its_origin(base, ground):
    with running_sitl("indoor", "--origin", "-33.85,151.2,20", base=base):
        place = ground.until(lambda: ground.last("GLOBAL_POSITION_INT"))
    assert place.lat == pytest.approx(-338_500_000, abs=2000)
    assert place.alt == pytest.approx(20_000, abs=500)


def test_garbage_on_its_ports_does_no_harm(base, ground):
    with running_sitl("--vehicles", "1", base=base):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            for datagram in (b"", b"\xfd", b"\xfd\xff\x00\x00" * 40, os.urandom(500)):
                stranger.sendto(datagram, ("127.0.0.1", 18570 + base))
                stranger.sendto(datagram, ("127.0.0.1", 14580 + base))
        ground.send(mavlink.MAVLink_command_long_message(1, 1, 401, 0, *[0] * 7))
        assert ground.until(lambda: ground.last("COMMAND_ACK")).result == 0


def test_every_one_of_130_vehicles_has_its_companions_port_and_leaves_those_of_the_fleet_link_free(base):
    sysids = 1, 10, 11, 41, 120, 121, 130
    ends = {sysid: socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for sysid in sysids}
    with ExitStack() as stack:
        for sysid, end in ends.items():
            stack.enter_context(end)
            end.bind(("127.0.0.1", companion_port(sysid) + base))
            end.settimeout(10.0)
        stack.enter_context(running_sitl("--vehicles", "130", base=base))
        for sysid, end in ends.items():
            frame, sender = end.recvfrom(2048)
            assert (frame[5], sender[1]) == (sysid, onboard_port(sysid) + base)


def test_what_one_companion_says_on_the_fleet_link_the_others_hear(base):
    ends = {sysid: socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for sysid in (1, 2, 3)}
    with ExitStack() as stack:
        for sysid, end in ends.items():
            stack.enter_context(end)
            end.bind(("127.0.0.1", fleet_port(sysid) + base))
            end.settimeout(5.0)
        stack.enter_context(running_sitl("--vehicles", "3", base=base))
        ends[2].sendto(b"here", ("127.0.0.1", RADIO_PORT + base))
        assert [ends[sysid].recv(100) for sysid in (1, 3)] == [b"here", b"here"]
        ends[2].settimeout(0.2)
        with pytest.raises(TimeoutError):
            ends[2].recv(100)


def test_a_companions_port_that_is_taken_by_the_simulator_or_the_ground_gets_nothing(base):
    """By these ports, that of vehicle 11 is the ground station's, that of vehicle 41 vehicle 1's own."""
    with running_sitl("--vehicles", "41", "--onboard-ports", "14580:14540", base=base):
        station = GroundStation(base)
        try:
            station.until(lambda: station.last("HEARTBEAT", 41))
            time.sleep(1.0)
            assert not station.of("HIGHRES_IMU"), "only onboard links get this"
        finally:
            station.close()


def test_the_onboard_links_can_be_moved(base):
    own, peer = 4000 + base % 500, 5000 + base % 500
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as companion:
        companion.bind(("127.0.0.1", peer + base + 1))
        companion.settimeout(10.0)
        with running_sitl("--vehicles", "2", "--onboard-ports", f"{own}:{peer}", base=base):
            _, sender = companion.recvfrom(2048)
    assert sender[1] == own + base + 1


@pytest.mark.parametrize("ports", ["17000", "a:b", "80:81", "17000:70000"])
def test_onboard_ports_that_are_none_are_refused(ports):
    done = subprocess.run([str(SITL), "--onboard-ports", ports, "--vehicles", "1"], capture_output=True, text=True)
    assert done.returncode == 2
    assert "expected two ports from 1024" in " ".join(done.stderr.replace("│", " ").split())


def test_faults_are_ordered_while_it_runs(base, ground):
    with running_sitl("--vehicles", "2", "--fault", "battery:vehicle=2,remaining=0.5", base=base):
        ground.until(lambda: ground.last("SYS_STATUS", 2))
        assert ground.last("SYS_STATUS", 2).battery_remaining == 50
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as experimenter:
            experimenter.settimeout(5.0)
            experimenter.sendto(b'{"type": "link", "vehicle": 1, "loss": 1.0}\n', ("127.0.0.1", 14990 + base))
            assert json.loads(experimenter.recv(2048))["ok"]
        ground.listen()
        ground.forget()
        ground.until(lambda: len(ground.of("ATTITUDE")) > 10)
        assert {m.get_srcSystem() for m in ground.heard} == {2}


def test_parameters_outlast_the_simulator(base, ground, tmp_path):
    arguments = ("--vehicles", "2", "--parameters", str(tmp_path))
    with running_sitl(*arguments, base=base) as process:
        ground.until(lambda: ground.last("HEARTBEAT", 2))
        ground.send(mavlink.MAVLink_param_set_message(2, 1, b"MIS_TAKEOFF_ALT", 4.25, 9), sysid=2)
        ground.until(lambda: ground.last("PARAM_VALUE", 2))
        ground.until((tmp_path / "vehicle-2.params").exists)
        os.kill(process.pid, signal.SIGKILL)
        process.wait(10.0)
    ground.listen()
    ground.forget()
    with running_sitl(*arguments, base=base):
        ground.until(lambda: ground.last("HEARTBEAT", 2))
        for sysid in (1, 2):
            ground.send(mavlink.MAVLink_param_request_read_message(sysid, 1, b"MIS_TAKEOFF_ALT", -1), sysid=sysid)
        values = [ground.until(lambda i=i: ground.last("PARAM_VALUE", i)).param_value for i in (1, 2)]
    assert values == [2.5, 4.25]


def test_with_a_key_everything_for_the_ground_is_signed_and_the_unsigned_has_no_effect(base, ground, tmp_path):
    key = bytes(range(32))
    (tmp_path / "key").write_text(key.hex())
    with running_sitl("--vehicles", "1", "--signing-key", str(tmp_path / "key"), base=base):
        frame = ground.until(lambda: ground.last("HEARTBEAT")).get_msgbuf()
        assert frame[-6:] == hashlib.sha256(key + frame[:-6]).digest()[:6]
        check = mavlink.MAVLink_command_long_message(1, 1, 401, 0, *[0] * 7)
        ground.send(check)
        ground.until(lambda: len(ground.of("HEARTBEAT")) >= 3)
        assert not ground.last("COMMAND_ACK")
        ground.sign(key)
        ground.send(check)
        assert ground.until(lambda: ground.last("COMMAND_ACK")).result == 0


def test_the_companion_gets_the_packets_of_its_lidar():
    base = next(b for b in range(100, 8900, 300) if all(is_free(port + b) for port in (56300, 14550, 18570)))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as companion:
        companion.bind(("127.0.0.1", 56300 + base + 1))
        companion.settimeout(10.0)
        with running_sitl("indoor", "--lidar", base=base):
            packet = unpack(companion.recv(2048))
    assert len(packet.points_flu_m) > 10
    assert np.linalg.norm(packet.points_flu_m, axis=1).max() < 5.5


def test_a_lidar_has_no_port_beyond_the_last_one():
    command = [str(SITL), "indoor", "--lidar", "--instance-base", "9000"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert "expected at most" in " ".join(done.stderr.replace("│", " ").split())
