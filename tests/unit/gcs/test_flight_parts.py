"""Fence, preflight checks, read-back comparison, safety parameters and the report's arithmetic."""

import asyncio
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from gcs.dialect import mavlink
from gcs.errors import PreflightError
from gcs.fleet.vehicle_state import VehicleState
from gcs.flight import preflight
from gcs.flight.events import KEPT_AFTER, MOST_KEPT, EventLog, Severity
from gcs.flight.fence import fence_height_m, fence_items
from gcs.flight.monitor import VehicleMonitor
from gcs.flight.preparation import Preparation
from gcs.flight.report import TRUTH_HEADER, Flown, min_separation_m, read_truth
from gcs.flight.safety_parameters import requirements
from gcs.flight.vehicle_flight import VehicleFlight
from gcs.link.codec import Codec
from gcs.microservices.mission_comparison import first_difference
from gcs.planner import plan_mission
from gcs.settings import PlanningMode
from gcs.station import Station
from missions.mission import load_mission
from missions.mission_items import Track, encode_track
from tests.simulation import virtual_time
from tests.unit.gcs import messages as mav

INDOOR = load_mission("indoor")
TERRAIN = load_mission("terrain-1-5uav")
ALPHA = INDOOR.vehicles[0]


def on_its_pad(shift_m: float = 0.0, height_m: float = 0.0) -> VehicleState:
    place = INDOOR.frame.geodetic(np.array([ALPHA.pad_m[0] + shift_m, ALPHA.pad_m[1], height_m]))
    state = VehicleState(1)
    for message in (
        mav.heartbeat(),
        mav.position(place.latitude_deg, place.longitude_deg, place.altitude_amsl_m),
        mav.home(place.latitude_deg, place.longitude_deg, place.altitude_amsl_m),
        mav.system_status(ready=True),
    ):
        state.fold(message, 10.0)
    return state


def test_a_vehicle_on_its_pad_is_fit_to_fly():
    assert list(preflight.problems(on_its_pad(), ALPHA, INDOOR, 10.1)) == []


def test_a_vehicle_off_its_pad_is_refused_with_the_distance():
    (problem,) = preflight.problems(on_its_pad(shift_m=1.5), ALPHA, INDOOR, 10.1)
    assert problem.startswith("stands 1.5 m from its pad")
    assert "--origin here" in problem


def test_what_keeps_a_vehicle_from_arming_is_named_in_the_autopilots_words():
    state = on_its_pad()
    state.fold(mav.system_status(ready=False), 10.0)
    state.fold(mav.status_text("Preflight Fail: ekf2 missing data", severity=3), 10.0)
    state.fold(mav.heartbeat(armed=True), 10.0)
    found = list(preflight.problems(state, ALPHA, INDOOR, 10.1))
    assert found == ["already armed", "not ready to arm; it said: Preflight Fail: ekf2 missing data"]


class Unready:
    """A connection with a vehicle behind it that stands on its pad, and says why it does not arm when it is asked."""

    peer = None
    budget_bytes_s: float | None = None

    def __init__(self) -> None:
        self.station, self.asked = Station(), 0

    async def speak(self) -> None:
        place = on_its_pad().place
        assert place is not None
        position = mav.position(place.latitude_deg, place.longitude_deg, place.altitude_amsl_m)
        while True:
            for message in (mav.heartbeat(), position, mav.system_status(ready=False)):
                self.hear(message)
            await asyncio.sleep(0.5)

    def hear(self, message) -> None:
        self.station.receive(self, bytes(message.get_msgbuf()), ("127.0.0.1", 1))

    def send(self, datagram: bytes, address: tuple[str, int]) -> None:
        (order,) = Codec().parse(datagram)
        assert (order.get_type(), order.command) == ("COMMAND_LONG", mavlink.MAV_CMD_RUN_PREARM_CHECKS)
        self.asked += 1
        loop = asyncio.get_running_loop()
        loop.call_soon(self.hear, mav.command_ack(order.command, mavlink.MAV_RESULT_ACCEPTED))
        loop.call_soon(self.hear, mav.status_text("Preflight Fail: horizontal position unstable", severity=3))


def test_a_vehicle_that_does_not_become_ready_is_asked_why_and_nothing_is_armed():
    async def play() -> int:
        vehicle = Unready()
        speaking = asyncio.create_task(vehicle.speak())
        await asyncio.sleep(0.1)
        preparation = Preparation(vehicle.station, INDOOR, PlanningMode.CLOUD, EventLog(lambda: 0.0), 1.0)
        monitor = VehicleMonitor(INDOOR.targets[0], INDOOR.on_arrival, 0.5, 300.0, True, True, INDOOR.frame, 0.0)
        with pytest.raises(PreflightError, match="it said: Preflight Fail: horizontal position unstable"):
            await preparation.prepare(VehicleFlight(ALPHA, monitor), [])
        speaking.cancel()
        return vehicle.asked

    assert virtual_time.run(play()) == 1


def test_old_news_is_no_position():
    state = on_its_pad()
    state.heard_s = 19.0
    assert list(preflight.problems(state, ALPHA, INDOOR, 20.0)) == ["no position"]
    assert list(preflight.problems(state, ALPHA, INDOOR, 30.0)) == ["no heartbeat"]


def test_the_ground_offset_is_what_home_reads_above_the_pad():
    assert preflight.ground_offset_m(on_its_pad(height_m=0.8), ALPHA, INDOOR) == pytest.approx(0.8, abs=2e-3)


def test_an_origin_here_puts_the_vehicle_onto_its_pad():
    somewhere = INDOOR.frame.geodetic(np.array([300.0, -200.0, 12.0]))
    moved = INDOOR.moved_to(preflight.origin_here(somewhere, ALPHA, INDOOR))
    place = (somewhere.latitude_deg, somewhere.longitude_deg, somewhere.altitude_amsl_m)
    np.testing.assert_allclose(moved.frame.enu(*place), ALPHA.pad_m, atol=0.02)


def test_the_fence_is_the_flight_range_and_its_margin():
    items = fence_items(INDOOR, [])
    corners = np.array([INDOOR.frame.enu(item.x / 1e7, item.y / 1e7, INDOOR.origin.altitude_amsl_m) for item in items])
    assert {item.command for item in items} == {mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION}
    assert all(item.param1 == 4.0 for item in items)
    np.testing.assert_allclose(corners[:, :2].min(axis=0), [-1.0, -1.0], atol=0.02)
    np.testing.assert_allclose(corners[:, :2].max(axis=0), [21.0, 16.0], atol=0.02)
    assert fence_height_m(INDOOR) == 5.0


def test_a_threat_is_fenced_only_where_no_plan_passes_over_it():
    around = np.array([[0, 0, 0], [1000, 200, 300], [2000, 700, 750]], dtype=float)
    over = np.array([[0, 0, 0], [1000, 1000, 600], [2000, 1200, 900]], dtype=float)

    def circles(curves) -> int:
        commands = [item.command for item in fence_items(TERRAIN, curves)]
        return commands.count(mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION)

    assert (circles([around]), circles([around, over])) == (1, 0)


TRACK = Track(np.array([[1, 6.5, 1.5], [19, 8.5, 1.5]]), np.array([3.0, 1.0]))
ITEMS = encode_track(TRACK, INDOOR.frame, acceptance_radius_m=0.3)


def test_what_reads_back_as_it_was_sent_differs_in_nothing():
    as_floats = [msgspec.structs.replace(item, z=float(np.float32(item.z)), param4=0.0) for item in ITEMS]
    assert first_difference(ITEMS, as_floats) == ""


@pytest.mark.parametrize(
    ("changes", "difference"),
    [
        ({"x": 1}, "x 1 instead of"),
        ({"z": 480.0}, "z 480.0 instead of"),
        ({"command": 21}, "command 21 instead of 16"),
        ({"param2": 2.0}, "param2 2.0 instead of 0.3"),
        ({"frame": 6}, "frame 6 instead of 5"),
        ({"z": float("nan")}, "z nan instead of"),
    ],
)
def test_a_difference_that_would_be_flown_is_found(changes: dict[str, float], difference: str):
    stored = list(ITEMS)
    stored[1] = msgspec.structs.replace(stored[1], **changes)
    assert first_difference(ITEMS, stored).startswith(f"item 1: {difference}")


def test_missing_items_are_found():
    assert first_difference(ITEMS, ITEMS[:-1]) == f"{len(ITEMS) - 1} items instead of {len(ITEMS)}"


def test_safety_parameters_hold_on_offboard_loss_and_time_out_in_wall_clock_seconds():
    needed = {required.name: required for required in requirements(INDOOR, speed=5.0)}
    assert needed["COM_OBL_RC_ACT"].value == 5
    assert not needed["COM_OBL_RC_ACT"].met_by(0)
    assert needed["COM_OF_LOSS_T"].met_by(5.0)
    assert needed["COM_OF_LOSS_T"].met_by(0.5)
    assert not needed["COM_OF_LOSS_T"].met_by(5.1)


def test_the_autopilot_itself_flies_at_the_missions_speed_and_no_faster():
    (limit,) = (required for required in requirements(INDOOR, speed=5.0) if required.name == "MPC_XY_VEL_MAX")
    assert limit.met_by(INDOOR.limits.cruise_speed_m_s)
    assert not limit.met_by(12.0)
    assert not limit.met_by(2.0)


@pytest.mark.parametrize(("name", "enough", "too_much"), [("MPC_XY_CRUISE", 2.5, 5.0), ("RTL_RETURN_ALT", 3.0, 30.0)])
def test_what_the_autopilot_flies_by_itself_stays_in_the_room_and_within_the_speed(name, enough, too_much):
    (limit,) = (required for required in requirements(INDOOR, speed=1.0) if required.name == name)
    assert limit.met_by(enough)
    assert not limit.met_by(too_much)
    assert not limit.value > {"MPC_XY_CRUISE": 0.95 * 3.0, "RTL_RETURN_ALT": 4.0 - INDOOR.limits.clearance_m}[name]


def flown(offset_m, speed_m_s: float = 1.0, begins_s: float = 0.0) -> Flown:
    times_s = np.arange(begins_s, 10.0, 0.1)
    along = np.stack((times_s * speed_m_s, np.zeros_like(times_s), np.ones_like(times_s)), axis=-1)
    return Flown(times_s, along + np.array(offset_m), np.tile([speed_m_s, 0, 0], (len(times_s), 1)))


def test_separation_is_taken_at_equal_times():
    same_way_later = flown([-3.0, 0.0, 0.0])
    assert min_separation_m([flown([0, 0, 0]), same_way_later]) == pytest.approx(3.0)
    faster = flown([-3.0, 0.5, 0.0], speed_m_s=2.0)
    assert min_separation_m([flown([0, 0, 0]), faster]) == pytest.approx(0.5, abs=0.02)
    assert min_separation_m([flown([0, 0, 0])]) is None


def test_a_flight_is_what_lies_between_the_first_and_the_last_movement():
    standing = Flown(
        np.arange(5.0), np.zeros((5, 3)), np.array([[0, 0, 0], [0, 0, 1], [0, 0, 0], [1, 0, 0], [0, 0, 0.0]])
    )
    assert standing.in_flight().times_s.tolist() == [1.0, 2.0, 3.0]
    parked = Flown(np.arange(3.0), np.zeros((3, 3)), np.zeros((3, 3)))
    assert len(parked.in_flight().times_s) == 0


def test_a_truth_log_is_read_and_a_torn_last_line_left_out(tmp_path: Path):
    path = tmp_path / "truth.csv"
    path.write_text(f"{TRUTH_HEADER}\n0.0,1,1,2,3,0,0,0\n0.0,2,5,6,7,0,0,0\n0.1,1,1.1,2,3,1,0,0\n0.1,2,5.")
    truth = read_truth(path)
    assert truth[1].positions_m.tolist() == [[1, 2, 3], [1.1, 2, 3]]
    assert len(truth[2].times_s) == 1
    path.write_text("something else\n")
    with pytest.raises(ValueError, match="expected a truth log"):
        read_truth(path)


def test_events_are_kept_written_and_told(tmp_path: Path):
    told = []
    log = EventLog(clock=iter([10.0, 12.5]).__next__, path=tmp_path / "events.jsonl", listeners=[told.append])
    log.add("armed", "armed", "alpha", Severity.WARNING, attempt=2)
    log.close()
    (line,) = (tmp_path / "events.jsonl").read_text().splitlines()
    assert msgspec.json.decode(line) == {
        "t_s": 2.5,
        "vehicle": "alpha",
        "kind": "armed",
        "text": "armed",
        "severity": "warning",
        "data": {"attempt": 2},
    }
    assert told == log.events


def test_the_newest_events_are_kept_in_memory():
    log = EventLog(lambda: 0.0)
    for number in range(50_000):
        log.add("said", f"text {number}")
    assert KEPT_AFTER <= len(log.events) <= MOST_KEPT
    assert log.events[-1].text == "text 49999"


def test_progress_along_a_plan_does_not_go_back_and_begins_anew_with_another_plan():
    part = plan_mission(INDOOR, seed=1).vehicles[0]
    monitor = VehicleMonitor(part.target, INDOOR.on_arrival, 0.5, 300.0, True, True, INDOOR.frame, 0.0)
    flight = VehicleFlight(ALPHA, monitor, part)
    last = len(part.curve_m) - 1
    for index in range(0, last + 1, 5):
        assert flight.progress(part.curve_m[index], reach_m=4.0) == index
    assert flight.progress(part.curve_m[0], reach_m=4.0) >= last - 5
    shorter = replace(part, curve_m=part.curve_m[-4:], times_s=part.times_s[-4:])
    flight.change_plan(shorter)
    assert flight.progress(shorter.curve_m[1], reach_m=4.0) == 1
