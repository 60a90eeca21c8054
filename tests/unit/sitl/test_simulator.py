"""The whole: one seed is one flight, estimates err as they are told to, and the truth is written down."""

import struct
import zlib

import numpy as np
import pytest

from missions.faults import BatteryLevel
from missions.frames import AutopilotFrame, GeodeticPoint
from missions.mission import Positioning, load_mission
from sitl.cli import warm_simulator
from sitl.dynamics.airframe import X500_LIKE
from sitl.fleet import TICK_S, Fleet
from sitl.link.truth_log import HEADER, TruthLog
from sitl.microservices.outbox import Link
from sitl.settings import Settings
from sitl.simulator import Simulator
from tests.unit.sitl.flown import NAN, Flown, field

GNSS = Positioning(
    horizontal_std_m=0.3, vertical_std_m=0.3, velocity_std_m_s=0.1, correlation_s=20.0, ground_offset_std_m=0.8
)


def flight(seed: int) -> int:
    """A CRC over all that a fleet sends in a windy flight on a bad link, and over where it went."""
    flown = Flown(load_mission("indoor-link-loss"), seed=seed).boot()
    for sysid in (1, 2):
        flown.command(22, 0, 0, 0, NAN, NAN, NAN, 492.0, sysid=sysid)
        flown.command(400, 1, sysid=sysid)
    crc = 0
    for _ in range(300):
        flown.simulator.step()
        for sysid, link, frame in flown.simulator.transmissions():
            crc = zlib.crc32(struct.pack("<BB", sysid, link is Link.GROUND) + frame, crc)
    return zlib.crc32(flown.simulator.truth.position_enu_m.tobytes(), crc)


def test_one_seed_is_one_flight_to_the_bit_and_another_seed_another():
    assert flight(5) == flight(5)
    assert flight(5) != flight(6)


def test_vehicles_stand_on_their_pads_until_they_fly():
    mission = load_mission("fleet-10")
    flown = Flown(mission).run(2.0)
    pads = np.array([vehicle.pad_m for vehicle in mission.vehicles])
    assert np.allclose(flown.simulator.truth.position_enu_m, pads, atol=1e-9)


def test_pads_on_a_mountain_are_on_its_ground():
    mission = load_mission("terrain-1-5uav")
    assert np.isfinite(Flown(mission).run(0.5).simulator.truth.position_enu_m).all()


def test_each_autopilot_has_an_origin_of_its_own_that_companions_can_convert_with():
    mission = field(3, positioning=GNSS)
    flown = Flown(mission, seed=5).run(1.0)
    altitudes = []
    for index, sysid in enumerate((1, 2, 3)):
        flown.command(512, 49, sysid=sysid, link=Link.ONBOARD)
        message = flown.last("GPS_GLOBAL_ORIGIN", sysid, Link.ONBOARD)
        origin = GeodeticPoint(
            latitude_deg=message.latitude / 1e7,
            longitude_deg=message.longitude / 1e7,
            altitude_amsl_m=message.altitude / 1e3,
        )
        home = flown.simulator.vehicles[sysid].autopilot.craft.home_altitude_m
        frame = AutopilotFrame(origin, mission.frame, ground_offset_m=home - 489.4)
        local = flown.last("LOCAL_POSITION_NED", sysid, Link.ONBOARD)
        seen = frame.enu(np.array([local.x, local.y, local.z]))
        truth = flown.simulator.truth.position_enu_m[index]
        assert np.linalg.norm(seen[:2] - truth[:2]) < 1.2  # the wandering error alone
        assert abs(seen[2] - truth[2]) < 0.3  # the offset of its altitude is taken out
        altitudes.append(origin.altitude_amsl_m)
    assert np.ptp(altitudes) > 0.3


def test_estimates_wander_as_widely_and_as_slowly_as_ordered():
    fleet = Fleet(field(20, positioning=GNSS), X500_LIKE, np.random.default_rng(2))
    errors = []
    for tick in range(120 * 50):
        fleet.advance(tick * TICK_S)
        if tick % 50 == 0:
            errors.append(fleet.vehicles["position_error_m"].copy())
    errors = np.array(errors)
    assert errors.std() == pytest.approx(0.3, rel=0.15)
    later = (errors[20:] * errors[:-20]).mean() / errors.var()
    assert later == pytest.approx(np.exp(-1.0), abs=0.12)  # one correlation time later
    assert fleet.vehicles["velocity_error_m_s"].std() == pytest.approx(0.1, rel=0.35)


def test_control_flies_on_the_estimate_and_not_on_the_truth():
    flown = Flown(field(positioning=Positioning(horizontal_std_m=0.5, correlation_s=3.0)), seed=3).take_off(3.0)
    flown.run(10.0)
    truth, seen = [], []
    for _ in range(300):
        flown.run(0.1)
        truth.append(flown.position[:2])
        seen.append((flown.autopilot.snapshot.y_m, flown.autopilot.snapshot.x_m))
    assert np.std(truth) > 0.15  # it follows its error about
    assert np.corrcoef(np.ravel(truth), np.ravel(np.array(seen) - truth))[0, 1] < -0.3


def test_wind_and_gusts_push_and_are_flown_against():
    calm = Flown(field()).take_off(5.0).run(10.0)
    windy = Flown(field(wind_enu_m_s=(6.0, 0.0, 0.0), gust_std_m_s=1.5)).take_off(5.0).run(20.0)
    assert abs(calm.autopilot.snapshot.roll_rad) < 0.01
    east = [windy.run(0.1).position[0] for _ in range(200)]
    assert abs(np.mean(east)) < 0.2
    assert windy.autopilot.craft.home.z_m == pytest.approx(0.0, abs=0.05)
    assert np.std(east) > 2 * np.std([calm.run(0.1).position[0] for _ in range(50)])


def test_the_truth_log_has_its_header_all_vehicles_and_the_missions_frame(tmp_path):
    simulator = Simulator(2, seed=1)
    path = tmp_path / "truth.csv"
    with TruthLog(path) as log:
        for _ in range(10):
            simulator.step()
            log.write(simulator.truth)
        flushed = path.read_text().splitlines()
    assert flushed[0] == HEADER == "t_s,sysid,east_m,north_m,up_m,ve_m_s,vn_m_s,vu_m_s"
    assert len(flushed) == 1 + 2 * 10
    rows = np.genfromtxt(path, delimiter=",", names=True)
    assert rows["t_s"][-1] == pytest.approx(0.2)
    assert rows["sysid"].tolist() == [1, 2] * 10
    assert rows["east_m"].tolist() == [0.0, 3.0] * 10


def test_datagrams_may_come_before_the_first_step():
    flown = Flown()
    assert flown.command(401) == 0


def test_local_positions_begin_at_zero_whatever_the_altitude_reads():
    flown = Flown(field(3, positioning=GNSS), seed=5).run(0.1)
    for sysid in (1, 2, 3):
        local = flown.last("LOCAL_POSITION_NED", sysid, Link.ONBOARD)
        assert np.allclose([local.x, local.y, local.z], 0.0, atol=0.2)


def test_a_warm_simulator_keeps_its_missions_faults_for_whatever_vehicle():
    """The code is warmed up with the first two vehicles, and these need not know the others' faults."""
    simulator = warm_simulator(field(3, faults=(BatteryLevel(vehicle=3, remaining=0.2),)), Settings(), {})
    assert list(simulator.vehicles) == [1, 2, 3]
    simulator.step()
    assert [memory.charge.remaining for memory in simulator.memories.values()] == [1.0, 1.0, 0.2]
