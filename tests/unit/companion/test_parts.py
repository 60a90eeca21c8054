"""The small parts: vehicle clock, quantiles, setpoints, course, status, journal, briefing."""

import json
from pathlib import Path

import numpy as np
import pytest

from companion.briefing import Briefing
from companion.errors import UsageError
from companion.figures import Quantiles
from companion.journal import Journal
from companion.setpoints import Heading, in_ned
from companion.vehicle_clock import LONGEST_EXTRAPOLATION_S, VehicleClock
from missions.frames import AutopilotFrame, swap_enu_ned
from missions.trajectory import Trajectory
from missions.tunnel import Reason
from tests.unit.companion.rig import HOME, INDOOR, TRACK_M, items_of

# ------------------------------------------------------------------------ vehicle clock


@pytest.mark.parametrize("speed", [1.0, 5.0])
def test_between_reports_vehicle_time_runs_at_the_speed_factor(speed: float):
    clock = VehicleClock(speed)
    clock.observe(50.0, 10.0)
    assert clock.now_s(10.0) == pytest.approx(50.0)
    assert clock.now_s(10.0 + 0.1 / speed) == pytest.approx(50.1)
    assert clock.age_s(10.0 + 0.1 / speed) == pytest.approx(0.1)


def test_jitter_of_the_reports_is_smoothed():
    clock, rng = VehicleClock(1.0), np.random.default_rng(1)
    errors = []
    for k in range(300):
        clock.observe(k * 0.033, k * 0.033 + rng.uniform(0.0, 0.02))
        errors.append(clock.now_s(k * 0.033 + 0.02) - k * 0.033)
    assert np.std(errors[50:]) < 0.003


def test_vehicle_time_never_runs_backwards():
    clock, rng = VehicleClock(2.0), np.random.default_rng(2)
    times, loop_s = [], 0.0
    for _ in range(500):
        loop_s += rng.uniform(0.0, 0.02)
        if rng.random() < 0.5:
            clock.observe(2.0 * loop_s + rng.normal(0.0, 0.05), loop_s)
        times.append(clock.now_s(loop_s))
    assert np.all(np.diff(times) >= 0.0)


def test_vehicle_time_stands_still_with_a_stalled_simulator():
    clock = VehicleClock(5.0)
    clock.observe(50.0, 10.0)
    assert clock.now_s(13.0) == pytest.approx(50.0 + LONGEST_EXTRAPOLATION_S)
    clock.observe(50.1, 13.0)
    assert clock.now_s(13.0) == pytest.approx(50.0 + LONGEST_EXTRAPOLATION_S)
    assert clock.now_s(13.03) == pytest.approx(50.25)


@pytest.mark.parametrize("reached", [1.2, 5.0])
def test_a_simulator_that_cannot_keep_up_sets_the_pace(reached: float):
    clock, errors = VehicleClock(10.0), []
    for k in range(200):
        loop_s = 5.0 + k * 0.02
        clock.observe(100.0 + reached * k * 0.02, loop_s)
        errors.append(clock.now_s(loop_s + 0.01) - (100.0 + reached * (k * 0.02 + 0.01)))
    assert clock.pace == pytest.approx(reached, rel=0.01)
    assert np.abs(errors[100:]).max() < 0.01


def test_the_pace_comes_back_and_jitter_does_not_change_it():
    clock, rng = VehicleClock(2.0), np.random.default_rng(4)
    for k in range(100):
        clock.observe(0.1 * k, 0.1 * k)
    assert clock.pace == pytest.approx(1.0, rel=0.01)
    paces = []
    for k in range(100):
        clock.observe(10.0 + 2.0 * 0.1 * k, 10.0 + 0.1 * k + rng.uniform(0.0, 0.02))
        paces.append(clock.pace)
    assert set(paces[20:]) == {2.0}


def test_a_rebooted_autopilot_sets_the_clock_back():
    clock = VehicleClock(1.0)
    clock.observe(500.0, 10.0)
    assert clock.now_s(10.0) == 500.0
    clock.observe(2.0, 11.0)
    assert clock.now_s(11.0) == pytest.approx(2.0)


def test_before_the_first_report_there_is_no_vehicle_time():
    clock = VehicleClock(1.0)
    assert (clock.now_s(5.0), clock.age_s(5.0)) == (0.0, float("inf"))


# ----------------------------------------------------------------------------- quantiles


def test_quantiles_agree_with_numpys_to_their_resolution():
    values = np.random.default_rng(3).gamma(2.0, 3.0, 4000)
    quantiles = Quantiles(resolution=0.05, largest=100.0)
    for value in values:
        quantiles.add(value)
    for share in (0.5, 0.99):
        assert quantiles.at(share) == pytest.approx(np.quantile(values, share), abs=0.1)


def test_quantiles_of_nothing_are_zero_and_large_values_are_cut():
    quantiles = Quantiles(resolution=0.1, largest=5.0)
    assert quantiles.at(0.99) == 0.0
    quantiles.add(1e9)
    assert quantiles.at(0.5) == pytest.approx(5.0)


# ----------------------------------------------------------------------------- setpoints


def test_converted_control_points_give_the_converted_trajectory():
    rng = np.random.default_rng(4)
    frame = AutopilotFrame(HOME, INDOOR.frame, 0.3)
    trajectory = Trajectory(rng.uniform(0.0, 15.0, (12, 3)), 5.0, 0.4)
    ned = in_ned(trajectory, frame)
    for time_s in np.linspace(5.0, 8.6, 13):
        here, there = trajectory.at(time_s), ned.at(time_s)
        np.testing.assert_allclose(there.position_m, frame.ned(here.position_m), atol=1e-5)
        # metres of an autopilot's frame are those of a sphere: up to 0.4 % from the ellipsoid's
        np.testing.assert_allclose(there.velocity_m_s, swap_enu_ned(here.velocity_m_s), rtol=0.004)
        np.testing.assert_allclose(there.acceleration_m_s2, swap_enu_ned(here.acceleration_m_s2), rtol=0.004)


def test_the_heading_turns_towards_the_path_no_faster_than_it_may():
    heading = Heading(0.0, rate_rad_s=0.8, above_m_s=0.4)
    east = np.array([0.0, 2.0, 0.0])
    assert heading.follow(east, 0.5) == pytest.approx(0.4)
    for _ in range(10):
        heading.follow(east, 0.5)
    assert heading.yaw_rad == pytest.approx(np.pi / 2)


def test_the_heading_takes_the_shorter_way_round():
    heading = Heading(np.radians(170.0), rate_rad_s=0.5, above_m_s=0.4)
    towards = np.array([np.cos(np.radians(-170.0)), np.sin(np.radians(-170.0)), 0.0])
    heading.follow(towards, 0.2)
    assert np.degrees(heading.yaw_rad) == pytest.approx(170.0 + np.degrees(0.1))
    heading.follow(towards, 0.5)
    assert np.degrees(heading.yaw_rad) == pytest.approx(-170.0)


def test_a_slow_vehicle_keeps_its_heading():
    heading = Heading(1.0, rate_rad_s=0.8, above_m_s=0.4)
    assert heading.follow(np.array([0.0, 0.3, 1.5]), 1.0) == 1.0


# ------------------------------------------------------------------------------ briefing


def test_the_ground_offset_is_taken_out_of_the_track_and_out_of_the_frame():
    """A vehicle whose altitude reads 0.8 m too high flies the same heights."""
    briefing = Briefing(INDOOR, INDOOR.vehicle(1))
    high = type(HOME)(
        latitude_deg=HOME.latitude_deg, longitude_deg=HOME.longitude_deg, altitude_amsl_m=HOME.altitude_amsl_m + 0.8
    )
    briefing.origin = briefing.home = high
    items = tuple(type(item)(**{**_fields(item), "z": item.z + 0.8 * (item.z > 0)}) for item in items_of())
    briefing.accept(7, items)
    assert briefing.order is not None
    np.testing.assert_allclose(briefing.order.track.points_m, TRACK_M, atol=0.02)
    ned = briefing.order.frame.ned(np.array([1.0, 6.5, 1.5]))
    np.testing.assert_allclose(ned, [0.0, 0.0, -1.5], atol=1e-3)


def _fields(item) -> dict:
    return {name: getattr(item, name) for name in item.__struct_fields__}


def test_a_briefing_says_what_is_missing():
    briefing = Briefing(INDOOR, INDOOR.vehicle(1))
    assert briefing.missing is Reason.NO_POSITION
    briefing.origin = briefing.home = HOME
    assert briefing.missing is Reason.NO_MISSION
    briefing.accept(7, items_of())
    assert briefing.missing is Reason.NONE
    briefing.forget()
    assert (briefing.missing, briefing.order, briefing.plan_id) == (Reason.NO_POSITION, None, 0)


# ------------------------------------------------------------------------------- journal


def test_the_journal_is_json_lines_with_vehicle_time(tmp_path: Path):
    lines: list[str] = []
    with Journal(3, tmp_path / "log.jsonl", lines.append) as journal:
        journal.write(12.34567, "state", state="READY")
        journal.write(13.0, "plan committed", replan_ms=2.5)
        journal.tell("READY")
    entries = [json.loads(line) for line in (tmp_path / "log.jsonl").read_text().splitlines()]
    assert entries == [
        {"t_s": 12.346, "event": "state", "state": "READY"},
        {"t_s": 13.0, "event": "plan committed", "replan_ms": 2.5},
    ]
    assert lines == ["companion 3: READY"]


def test_a_log_that_cannot_be_written_is_bad_usage(tmp_path: Path):
    with pytest.raises(UsageError, match=r"nowhere/log\.jsonl: cannot be written: No such file"):
        Journal(1, tmp_path / "nowhere" / "log.jsonl")
