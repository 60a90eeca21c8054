"""What the autopilot does by itself when something is lost: the ground station, charge, or its way."""

import numpy as np
import pytest

from sitl.dialect import mavlink
from tests.unit.sitl.flown import NAN, Flown, place, waypoint

HEARTBEAT = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
TEMPORARILY_REJECTED = 1


def with_gcs(action: int) -> Flown:
    """Hovering, with a ground station that has just gone silent."""
    flown = Flown()
    flown.gcs_is_there = True
    flown.set_parameter("NAV_DLL_ACT", action)
    flown.take_off(5.0)
    flown.gcs_is_there = False
    return flown


# -------------------------------------------------------------- ground station
def test_losing_the_ground_station_does_nothing_by_default():
    flown = with_gcs(0).run(30.0)
    assert flown.mode == "HOLD"
    assert flown.last("HEARTBEAT").system_status == 4
    flown.gcs_is_there = True
    flown.run(1.1)
    assert flown.texts[-2:] == ["Connection to ground station lost", "GCS connection regained"]


def test_losing_the_ground_station_returns_after_a_wait_in_hold():
    flown = with_gcs(2)
    assert flown.until(lambda: flown.last("HEARTBEAT").system_status == 5, 15.0) == pytest.approx(10.5, abs=1.0)
    assert flown.mode == "HOLD"
    assert flown.until(lambda: flown.mode == "RTL", 8.0) == pytest.approx(5.0, abs=1.0)
    flown.gcs_is_there = True
    assert flown.run(3.0).mode == "RTL"  # coming back does not cancel it
    assert flown.command(176, 1, 4, 3) == 0
    assert flown.run(2.0).mode == "HOLD"  # a pilot's mode does


def test_where_a_loss_has_an_action_arming_needs_a_ground_station():
    flown = Flown().boot()
    flown.set_parameter("NAV_DLL_ACT", 2)
    assert flown.command(400, 1) == TEMPORARILY_REJECTED
    flown.send(HEARTBEAT)
    flown.run(0.1)
    assert flown.command(400, 1) == 0


def test_losing_the_companion_is_said():
    flown = Flown().boot()
    companion = mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3)
    flown.send(companion, source=(1, 191))
    flown.run(6.0)
    assert "Connection to mission computer lost" in flown.texts


# -------------------------------------------------------------------- battery
def test_a_battery_drains_to_half_while_armed_and_is_full_again_after():
    flown = Flown().take_off(3.0).run(40.0)
    assert flown.last("SYS_STATUS").battery_remaining == 50
    assert flown.last("SYS_STATUS").voltage_battery == pytest.approx(15300, abs=1)
    flown.command(21)
    flown.until(lambda: not flown.armed, 30.0)
    assert flown.run(1.1).last("SYS_STATUS").battery_remaining == 100


def test_an_empty_battery_warns_waits_and_lands():
    flown = Flown()
    flown.set_parameter("SIM_BAT_MIN_PCT", 0.0)
    flown.set_parameter("SIM_BAT_DRAIN", 40.0)
    flown.take_off(5.0)
    flown.until(lambda: "Low battery" in flown.texts, 40.0)
    assert flown.mode == "HOLD"
    flown.until(lambda: "Critical battery" in flown.texts, 10.0)
    flown.until(lambda: flown.mode == "LAND", 8.0)
    assert "Failsafe activated: entering Hold for 5 seconds" in flown.texts
    assert "Emergency battery level" in flown.texts
    flown.until(lambda: not flown.armed, 30.0)


# ------------------------------------------------------------------- geofence
def square(half_m: float, command: int = 5001) -> list[tuple]:
    corners = [(half_m, half_m), (half_m, -half_m), (-half_m, -half_m), (-half_m, half_m)]
    return [(5, command, 4.0, 0.0, 0.0, 0.0, *place(*corner), 0.0) for corner in corners]


def fenced(action: int, items: list[tuple] | None = None) -> Flown:
    flown = Flown().take_off(4.0)
    flown.set_parameter("GF_ACTION", action)
    if items is not None:
        assert flown.upload(items, kind=1) == 0
    return flown.stream(position=(0.0, 0.0, -4.0)).offboard()


def test_crossing_the_fence_holds_and_the_pilot_may_take_over_again():
    flown = fenced(2, square(10.0))
    flown.stream(velocity=(4.0, 0.0, 0.0)).run(5.0)
    assert flown.mode == "HOLD"
    assert flown.last("HEARTBEAT").system_status == 5
    assert "Geofence violation: approaching or outside geofence" in flown.texts
    flown.run(4.0)
    assert 10.0 < flown.position[1] < 17.0
    assert np.linalg.norm(flown.velocity) < 0.3
    flown.stream(position=(0.0, 0.0, -4.0))
    assert flown.command(176, 1, 6) == 0
    assert flown.run(6.0).mode == "OFFBOARD"
    assert flown.position[1] < 3.0


@pytest.mark.parametrize(
    ("action", "mode"), [(0, "OFFBOARD"), (1, "OFFBOARD"), (3, "RTL"), (5, "LAND"), (4, "TERMINATION")]
)
def test_the_fences_action_is_the_parameters(action, mode):
    flown = fenced(action, square(8.0))
    flown.stream(velocity=(4.0, 0.0, 0.0)).run(4.5)
    assert flown.mode == mode


@pytest.mark.parametrize(
    "items",
    [
        [(5, 5003, 8.0, 0, 0, 0, *place(0, 0), 0.0)],  # a circle to stay in
        [
            (5, 5002, 4.0, 0, 0, 0, *place(n, e), 0.0) for n, e in ((8, -9), (30, -9), (30, 9), (8, 9))
        ],  # an area to keep out of
        [(5, 5004, 5.0, 0, 0, 0, *place(13, 0), 0.0)],  # a circle to keep out of
    ],
)
def test_all_kinds_of_fences_are_kept(items):
    flown = fenced(2, items)
    flown.stream(velocity=(4.0, 0.0, 0.0))
    flown.until(lambda: flown.mode == "HOLD", 6.0)
    assert flown.position[1] == pytest.approx(8.5, abs=1.0)


def test_distance_and_height_limits_are_a_fence():
    flown = fenced(2)
    flown.set_parameter("GF_MAX_VER_DIST", 6.0)
    flown.stream(velocity=(0.0, 0.0, -1.0))
    flown.until(lambda: flown.mode == "HOLD", 5.0)
    assert flown.height == pytest.approx(6.2, abs=0.4)


def test_a_fence_around_somewhere_else_is_not_enforced():
    flown = fenced(2, [(5, 5003, 5.0, 0, 0, 0, *place(100, 0), 0.0)])
    assert "Geofence invalid, doesn't contain current vehicle position" in flown.texts
    assert flown.run(2.0).mode == "OFFBOARD"


def test_a_mission_that_leaves_the_fence_is_stored_and_not_flown():
    flown = Flown().boot()
    flown.upload(square(10.0), kind=1)
    assert flown.upload([waypoint(5.0, 0.0, 4.0), waypoint(20.0, 0.0, 4.0)]) == 0
    assert "Geofence violation for waypoint 2" in flown.texts
    assert flown.command(300) == 2
    flown.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 1))
    flown.run(0.1)
    assert flown.command(300) == 0


def test_a_reposition_out_of_the_fence_is_refused_though_acknowledged():
    flown = Flown().take_off(4.0)
    flown.set_parameter("GF_MAX_HOR_DIST", 20.0)
    x, y = place(50.0, 0.0)
    assert flown.command(192, -1, 1, 0, NAN, x * 1e-7, y * 1e-7, 493.4) == 0
    assert "Reposition is outside geofence" in flown.run(3.0).texts
    assert abs(flown.position[1]) < 0.3


# --------------------------------------------------------------------- return
def test_return_climbs_flies_home_and_lands_there():
    flown = Flown().take_off(8.0)
    x, y = place(40.0, 0.0)
    flown.command(192, -1, 1, 0, NAN, x * 1e-7, y * 1e-7, 497.4)
    flown.run(16.0)
    assert flown.command(20) == 0
    took_s = flown.until(lambda: bool(flown.autopilot.snapshot.landed), 120.0)
    assert 45.0 < took_s < 75.0
    heights = [m.relative_alt / 1e3 for m in flown.messages("GLOBAL_POSITION_INT")]
    assert max(heights) == pytest.approx(30.0, abs=1.0)
    assert np.allclose(flown.position[:2], 0.0, atol=0.3)
    assert any("RTL: start return at 519 m (30 m above destination)" in text for text in flown.texts)


RALLY = [(6, 5100, 0, 0, 0, 0, *place(40.0, 15.0), 0.0), (6, 5100, 0, 0, 0, 0, *place(-60.0, 0.0), 0.0)]


@pytest.mark.parametrize(("kind", "there"), [(0, (0.0, 15.0)), (1, (15.0, 40.0))])
def test_return_flies_to_the_nearest_of_home_and_rally_points(kind, there):
    flown = Flown().take_off(5.0)
    flown.upload(RALLY, kind=2)
    flown.set_parameter("RTL_TYPE", 1)
    flown.set_parameter("RTL_RETURN_ALT", 8.0)
    if kind == 0:
        flown.set_parameter("RTL_TYPE", 0)
        flown.upload([(6, 5100, 0, 0, 0, 0, *place(15.0, 0.0), 0.0), RALLY[0]], kind=2)
    x, y = place(25.0, 0.0)
    flown.command(192, -1, 1, 0, NAN, x * 1e-7, y * 1e-7, 494.4)
    flown.run(10.0)
    flown.command(20)
    flown.until(lambda: not flown.armed, 60.0)
    assert np.allclose(flown.position[:2], there, atol=0.4)


@pytest.mark.parametrize(("kind", "there"), [(0, (0.0, 0.0)), (1, (0.0, 25.0)), (2, (0.0, 25.0)), (3, (0.0, 25.0))])
def test_return_may_go_to_the_missions_own_landing(kind, there):
    flown = Flown().take_off(5.0)
    landing = (6, 21, 0, 0, 0, NAN, *place(25.0, 0.0), 0.0)
    flown.upload([waypoint(5.0, 5.0, 5.0), (2, 189, 0, 0, 0, 0, 0, 0, 0.0), landing])
    flown.set_parameter("RTL_TYPE", kind)
    flown.set_parameter("RTL_RETURN_ALT", 8.0)
    x, y = place(20.0, 0.0)
    flown.command(192, -1, 1, 0, NAN, x * 1e-7, y * 1e-7, 494.4)
    flown.run(10.0)
    flown.command(20)
    flown.until(lambda: not flown.armed, 60.0)
    assert np.allclose(flown.position[:2], there, atol=0.4)


def test_return_goes_home_when_that_is_nearest():
    flown = Flown().take_off(5.0)
    flown.upload(RALLY, kind=2)
    x, y = place(6.0, 0.0)
    flown.command(192, -1, 1, 0, NAN, x * 1e-7, y * 1e-7, 494.4)
    flown.run(8.0)
    flown.command(20)
    flown.until(lambda: not flown.armed, 60.0)
    assert np.allclose(flown.position[:2], 0.0, atol=0.4)


def test_return_near_home_stays_low():
    flown = Flown().take_off(5.0)
    x, y = place(6.0, 0.0)
    flown.command(192, -1, 1, 0, NAN, x * 1e-7, y * 1e-7, 494.4)
    flown.run(8.0)
    flown.command(20)
    flown.run(10.0)
    assert max(m.relative_alt for m in flown.messages("GLOBAL_POSITION_INT")) < 7500
