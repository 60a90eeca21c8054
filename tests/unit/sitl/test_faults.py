"""Faults by mission file, command line and control port: what they do, and who refuses them."""

import itertools
import json
from pathlib import Path

import numpy as np
import pytest

import missions
from missions.errors import MissionError
from missions.faults import (
    BatteryLevel,
    GpsLoss,
    LinkConditions,
    LinkFault,
    MotorFailure,
    Reboot,
    SensorNoise,
    SimulatedLink,
    Weather,
    decode_simulator_fault,
    format_fault,
    parse_any_fault,
    parse_simulator_fault,
)
from missions.mission import LinkSettings, load_mission
from sitl.dialect import mavlink
from sitl.link.control_port import obey
from sitl.link.faulty_link import Direction, FaultyLink
from sitl.microservices.outbox import Link
from tests.unit.sitl.flown import NAN, Flown, field


# ------------------------------------------------------------------------ links
def passed(conditions: LinkConditions, n: int = 2000, n_bytes: int = 2, interval_s: float = 0.0) -> list[tuple]:
    """What arrives of `n` numbered datagrams: (tick of arrival, number)."""
    link = FaultyLink(LinkSettings(), np.random.default_rng(1))
    link.change(conditions)
    out = []
    for i in range(n):
        link.send(Direction.DOWN, i.to_bytes(2, "little").ljust(n_bytes, b"\0"), i * interval_s, None)
    for tick in range(2000):
        out += [(tick * 0.01, int.from_bytes(d[:2], "little")) for d in link.arrived(Direction.DOWN, tick * 0.01)]
    return out


def test_duplicates_are_as_many_as_ordered():
    assert len(passed(LinkConditions(duplicates=0.25))) == pytest.approx(2500, abs=80)


def test_reordered_datagrams_are_overtaken_and_nothing_is_lost():
    numbers = [number for _, number in passed(LinkConditions(reorder=0.1), n=500, interval_s=0.01)]
    assert sorted(numbers) == list(range(500))
    assert 30 < sum(later < earlier for earlier, later in itertools.pairwise(numbers)) < 70


def test_of_corrupted_datagrams_one_byte_is_another():
    sent = bytes(range(40))
    link = FaultyLink(LinkSettings(corruption=0.25), np.random.default_rng(1))
    for _ in range(2000):
        link.send(Direction.UP, sent, 0.0, None)
    arrived = link.arrived(Direction.UP, 0.0)
    changed = [sum(a != b for a, b in zip(sent, datagram, strict=True)) for datagram in arrived]
    assert changed.count(1) == pytest.approx(500, abs=60)
    assert set(changed) == {0, 1}


def test_a_narrow_link_passes_its_bandwidth_and_loses_what_would_wait_too_long():
    arrived = passed(LinkConditions(bandwidth_bytes_s=1000.0), n=1000, n_bytes=100, interval_s=0.005)
    assert len(arrived) == pytest.approx(60, abs=2)  # 5 s and the queue's second at ten a second
    gaps = np.diff([time_s for time_s, _ in arrived])
    assert np.allclose(gaps, 0.1, atol=0.011)


@pytest.mark.parametrize("link", list(Link))
def test_one_link_of_one_vehicle_can_be_cut_for_a_while_at_run_time(link):
    flown = Flown(field(2)).boot()
    flown.simulator.order(LinkFault(vehicle=1, link=SimulatedLink(link.value), blackout_s=3.0))
    flown.forget()
    flown.run(2.9)
    assert not flown.heard(link)
    assert flown.heard(link.other)
    assert flown.heard(link, sysid=2)
    assert flown.command(401, link=link) is None
    flown.run(0.2)
    assert flown.command(401, link=link) == 0


def test_a_link_is_made_whole_again_without_overtaking_what_is_on_its_way():
    flown = Flown().boot()
    flown.simulator.order(LinkFault(delay_s=0.5))
    flown.run(1.0)
    flown.forget()
    flown.simulator.order(LinkFault())
    flown.run(1.0)
    times = [m.time_boot_ms for m in flown.messages("ATTITUDE")]
    assert times == sorted(times)
    assert times[-1] == pytest.approx(flown.time_s * 1e3, abs=110)


def test_a_mission_file_can_fault_the_onboard_link():
    flown = Flown(field(onboard_link=LinkSettings(loss=1.0))).run(2.0)
    assert flown.heard(Link.GROUND)
    assert not flown.heard(Link.ONBOARD)


# ------------------------------------------------------------------ positioning
def test_without_positioning_a_vehicle_reckons_on_then_lands_where_it_drifts():
    flown = Flown().take_off(4.0)
    flown.simulator.order(GpsLoss())
    flown.run(4.5)
    assert flown.last("GPS_RAW_INT").fix_type == 0
    assert flown.mode == "HOLD"
    assert flown.messages("LOCAL_POSITION_NED")[-1].time_boot_ms > (flown.time_s - 0.2) * 1e3
    flown.run(1.0)
    assert flown.mode == "LAND"
    assert "Failsafe activated" in flown.texts
    flown.forget()
    flown.run(1.0)
    assert flown.messages("LOCAL_POSITION_NED")
    assert flown.messages("GLOBAL_POSITION_INT")
    assert not flown.last("ESTIMATOR_STATUS").flags & (2 | 8 | 16)
    assert not flown.last("SYS_STATUS").onboard_control_sensors_health & 0x20
    assert flown.velocity[2] == pytest.approx(-0.7, abs=0.2)
    flown.until(lambda: not flown.armed, 20.0)
    assert not flown.simulator.collisions
    assert flown.run(1.0).command(400, 1) == 1


def test_estimates_run_away_without_positioning_and_come_back_with_it():
    def error(flown: Flown) -> float:
        return float(np.hypot(*flown.simulator._fleet.vehicles["position_error_m"][0][:2]))

    flown = Flown().take_off(4.0)
    flown.simulator.order(GpsLoss(duration_s=4.0))
    flown.run(3.98)
    assert 0.02 < error(flown) < 2.0
    flown.run(25.0)
    assert error(flown) < 0.02
    assert flown.mode == "HOLD"
    assert flown.last("GPS_RAW_INT").fix_type == 3


def test_positioning_that_comes_back_ends_the_blind_landing():
    flown = Flown().take_off(8.0)
    flown.simulator.order(GpsLoss(duration_s=7.0))
    flown.until(lambda: flown.mode == "LAND", 6.0)
    flown.until(lambda: flown.mode == "HOLD", 3.0)
    flown.run(3.0)
    assert np.linalg.norm(flown.velocity) < 0.3


def test_offboard_by_position_needs_positioning_and_by_attitude_does_not():
    flown = Flown().take_off(6.0)
    flown.stream(position=(0.0, 0.0, -6.0)).offboard()
    flown.simulator.order(GpsLoss())
    assert flown.run(6.0).mode == "LAND"
    assert flown.velocity[2] < -0.4
    level = mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 7, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0, 0.6)
    flown.go_silent().send(level, link=Link.ONBOARD)
    flown.run(0.04)
    assert flown.mode == "OFFBOARD"


def test_a_pilots_landing_goes_on_blind():
    flown = Flown().take_off(6.0)
    flown.command(21)
    flown.simulator.order(GpsLoss())
    flown.until(lambda: not flown.armed, 30.0)
    assert flown.height == pytest.approx(0.0, abs=0.01)


# ------------------------------------------------------------ motors, batteries
def test_without_a_motor_a_vehicle_tumbles_down_and_stays_there():
    flown = Flown().take_off(8.0)
    flown.simulator.order(MotorFailure(vehicle=1, motor=2))
    flown.until(lambda: bool(flown.simulator.collisions), 6.0)
    flown.run(1.0)
    assert not flown.armed
    assert flown.height == pytest.approx(0.0, abs=0.05)
    assert flown.command(400, 1) == 1


def test_a_vehicle_that_tips_over_is_terminated_where_the_breaker_allows_it():
    flown = Flown()
    flown.set_parameter("CBRK_FLIGHTTERM", 0)
    flown.take_off(30.0)
    flown.simulator.order(MotorFailure(vehicle=1, motor=2))
    flown.until(lambda: flown.mode == "TERMINATION", 2.0)
    assert flown.last("HEARTBEAT").system_status == 8 or flown.run(1.0).last("HEARTBEAT").system_status == 8


def test_a_weak_motor_is_flown_with():
    flown = Flown().take_off(5.0)
    flown.simulator.order(MotorFailure(vehicle=1, motor=1, health=0.9))
    flown.run(8.0)
    assert flown.mode == "HOLD"
    assert flown.height == pytest.approx(5.0, abs=0.3)


@pytest.mark.parametrize(
    ("remaining", "text", "mode"), [(0.06, "Critical battery", "RTL"), (0.04, "Emergency", "LAND")]
)
def test_a_battery_that_is_suddenly_empty_is_a_failsafe(remaining, text, mode):
    flown = Flown().take_off(5.0)
    flown.simulator.order(BatteryLevel(vehicle=1, remaining=remaining))
    flown.run(1.0)
    assert any(text in said for said in flown.texts)
    assert flown.mode == "HOLD"
    assert flown.run(5.0).mode == mode
    assert flown.last("SYS_STATUS").battery_remaining == round(remaining * 100)


def test_a_failed_battery_is_not_full_again_after_a_landing_or_a_reboot():
    flown = Flown().boot()
    flown.simulator.order(BatteryLevel(remaining=0.3))
    flown.simulator.order(Reboot(vehicle=1))
    flown.run(3.0)
    assert flown.last("SYS_STATUS").battery_remaining == 30


# ------------------------------------------------------- noise, weather, reboot
@pytest.mark.parametrize(("remaining", "result"), [(0.24, 0), (0.1, 0), (0.06, 1)])
def test_nobody_arms_on_a_critical_battery(remaining, result):
    flown = Flown().boot()
    flown.simulator.order(BatteryLevel(remaining=remaining))
    assert flown.run(0.1).command(400, 1) == result


def test_noise_makes_the_estimate_wander():
    flown = Flown().take_off(5.0)
    flown.simulator.order(SensorNoise(horizontal_std_m=0.5, vertical_std_m=0.1, velocity_std_m_s=0.1))
    off = []
    for _ in range(200):
        flown.run(0.2)
        off.append(flown.simulator._fleet.vehicles["position_error_m"][0].tolist())
    spread = np.std(off, axis=0)
    assert 0.2 < spread[0] < 0.9
    assert spread[2] == pytest.approx(0.1, abs=0.06)


def test_wind_can_rise_while_a_vehicle_flies():
    flown = Flown().take_off(5.0)
    flown.simulator.order(Weather(east_m_s=8.0))
    flown.run(1.0)
    assert flown.position[0] > 0.02
    flown.run(15.0)
    assert abs(flown.position[0]) < 0.1  # held against it


def test_a_reboot_in_the_air_is_a_fall():
    flown = Flown().take_off(10.0)
    flown.simulator.order(Reboot(vehicle=1))
    flown.forget()
    flown.run(0.9)
    assert not flown.heard(Link.GROUND)
    assert flown.velocity[2] < -5.0
    flown.run(3.0)
    assert flown.simulator.collisions
    assert not flown.armed


def test_after_a_reboot_the_origin_is_where_the_vehicle_stands():
    flown = Flown().take_off(3.0)
    flown.stream(position=(8.0, 2.0, -3.0)).offboard().run(8.0)
    flown.command(21)
    flown.until(lambda: not flown.armed, 20.0)
    flown.command(246, 1)
    flown.run(2.5)
    assert np.allclose(flown.autopilot.snapshot[:3], 0.0, atol=0.05)
    flown.command(512, 242)
    assert flown.last("HOME_POSITION").latitude == pytest.approx(473_977_432 + 719, abs=15)


def test_one_seed_and_the_same_faults_are_one_flight():
    def flight() -> list:
        flown = Flown(field(faults=(GpsLoss(at_s=1.0, duration_s=2.0), LinkFault(at_s=0.5, loss=0.5))), seed=4)
        flown.take_off(3.0).run(4.0)
        return [*flown.position.tolist(), len(flown.heard(Link.GROUND))]

    assert flight() == flight()


def test_faults_with_a_time_wait_for_the_first_take_off():
    flown = Flown(field(faults=(BatteryLevel(remaining=0.2, at_s=2.0),))).boot()
    flown.run(3.0)
    assert flown.autopilot.battery.remaining == 1.0
    flown.command(22, *[NAN] * 7)
    flown.command(400, 1)
    flown.until(lambda: not flown.autopilot.snapshot.grounded, 10.0)
    flown.run(1.9)
    assert flown.autopilot.battery.remaining > 0.5
    assert flown.run(0.2).autopilot.battery.remaining <= 0.2


# ------------------------------------------------------------------ how to order
def test_the_control_port_obeys_line_by_line_and_answers_each():
    flown = Flown().boot()
    lines = [
        b'{"type": "battery", "vehicle": 1, "remaining": 0.4}',
        b'{"type": "battery", "vehicle": 9, "remaining": 0.4}',
        b'{"type": "battery", "remaining": 4}',
        b'{"type": "lightning"}',
        b"\xff\xfe",
        b'{"type": "reboot", "vehicle": 1, "bogus": 1}',
    ]
    answers = [json.loads(line) for line in obey(flown.simulator, b"\n".join(lines) + b"\n\n").splitlines()]
    assert [answer["ok"] for answer in answers] == [True, False, False, False, False, False]
    assert answers[0]["time_s"] == pytest.approx(flown.time_s)
    assert "expected one of 1, found 9" in answers[1]["error"]
    assert "$.remaining" in answers[2]["error"]
    assert "lightning" in answers[3]["error"]
    assert "bogus" in answers[5]["error"]
    assert flown.run(0.02).autopilot.battery.remaining == 0.4


EVERY_FAULT = [
    {"type": "link", "vehicle": 1, "loss": 0.5},
    {"type": "link", "vehicle": 1, "delay_s": 0.3},
    {"type": "link", "link": "ground", "jitter_s": 0.4},
    {"type": "link", "duplicates": 0.5},
    {"type": "link", "reorder": 0.5},
    {"type": "link", "corruption": 0.5},
    {"type": "link", "bandwidth_bytes_s": 800},
    {"type": "link", "blackout_s": 0.7},
    {"type": "gps-loss", "vehicle": 1, "duration_s": 1},
    {"type": "motor-failure", "vehicle": 1, "motor": 2, "health": 0.4},
    {"type": "battery", "remaining": 0.3},
    {"type": "sensor-noise", "horizontal_std_m": 2, "vertical_std_m": 2, "velocity_std_m_s": 1},
    {"type": "weather", "east_m_s": 5, "gust_std_m_s": 2},
    {"type": "reboot", "vehicle": 1},
    {"type": "clock-jump", "vehicle": 1, "by_s": -30},
]


def flight_with(order: dict | None, way: str, tmp_path: Path) -> tuple:
    """Where a vehicle is and what it has said, a second and a half after a fault in its first flight."""
    text = (Path(missions.__file__).parent / "field.yaml").read_text()
    file = tmp_path / "faulty.yaml"
    file.write_text(text + f"  faults: {json.dumps([order])}\n" if order and way == "mission file" else text)
    flown = Flown(load_mission(str(file)), seed=3)
    if order and way == "command line":
        kind, *fields = order.values()
        pairs = zip(list(order)[1:], fields, strict=True)
        flown.simulator.order(parse_simulator_fault(f"{kind}:" + ",".join(f"{key}={value}" for key, value in pairs)))
    if order and way == "control port":
        assert json.loads(obey(flown.simulator, json.dumps(order).encode()))["ok"]
    flown.boot().command(22, *[NAN] * 7)
    flown.command(400, 1)
    flown.run(4.0)
    return tuple(flown.position), flown.autopilot.battery.remaining, flown.heard(Link.GROUND)


@pytest.mark.parametrize("fault", EVERY_FAULT, ids=lambda fault: f"{fault['type']} {list(fault)[-1]}")
def test_every_fault_acts_and_the_same_whichever_way_it_is_ordered(fault, tmp_path):
    timed = {**fault, "at_s": 0.5}
    by_file, by_line, at_run_time = (
        flight_with(timed, way, tmp_path) for way in ("mission file", "command line", "control port")
    )
    assert by_file == by_line == at_run_time
    assert by_file != flight_with(None, "", tmp_path)


def test_a_mission_that_faults_a_vehicle_that_it_does_not_have_is_refused():
    with pytest.raises(MissionError, match="expected one of 1, 2, found 3"):
        Flown(field(2, faults=(Reboot(vehicle=3),)))


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("link:vehicle=2,link=onboard,loss=0.5", LinkFault(vehicle=2, link=SimulatedLink.ONBOARD, loss=0.5)),
        ("gps-loss:at_s=3", GpsLoss(at_s=3.0)),
        ("motor-failure:vehicle=1,motor=4", MotorFailure(vehicle=1, motor=4)),
        ("weather:north_m_s=-3,gust_std_m_s=1", Weather(north_m_s=-3.0, gust_std_m_s=1.0)),
    ],
)
def test_faults_are_written_on_the_command_line_and_as_json(text, fault):
    assert parse_simulator_fault(text) == fault
    kind, _, rest = text.partition(":")
    fields = {
        key: json.loads(value) if value[-1].isdigit() else value
        for key, value in (p.split("=") for p in rest.split(","))
    }
    assert decode_simulator_fault(json.dumps({"type": kind, **fields}).encode()) == fault
    assert parse_any_fault(format_fault(fault)) == fault


@pytest.mark.parametrize(
    "text", ["", "link", "link:loss=2", "link:delay_s=inf", "reboot:vehicle=0", "battery:remaining=nan"]
)
def test_bad_faults_are_explained(text):
    if text == "link":
        assert parse_simulator_fault(text) == LinkFault()
        return
    with pytest.raises(MissionError, match="expected something like"):
        parse_simulator_fault(text)
