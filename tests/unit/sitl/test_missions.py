"""Missions are flown item by item, swapped in flight, and end as PX4 ends them."""

import itertools

import numpy as np
import pytest

from sitl.dialect import mavlink
from sitl.microservices.outbox import Link
from tests.unit.sitl.flown import NAN, Flown, place, waypoint

ACCEPTED, TEMPORARILY_REJECTED, DENIED = 0, 1, 2


def speed(speed_m_s: float) -> tuple:
    return (2, 178, 1.0, speed_m_s, -1.0, 0.0, 0, 0, 0.0)


def land(north_m: float, east_m: float) -> tuple:
    return (6, 21, 0.0, 0.0, 0.0, NAN, *place(north_m, east_m), 0.0)


RETURN = (2, 20, 0.0, 0.0, 0.0, 0.0, 0, 0, 0.0)


def reached(flown: Flown) -> list[int]:
    """Sequence numbers that were reported, without the repetitions."""
    seqs = [m.seq for m in flown.messages("MISSION_ITEM_REACHED")]
    return [seq for i, seq in enumerate(seqs) if seq not in seqs[:i]]


def test_waypoints_are_passed_in_order_within_their_radius():
    flown = Flown().take_off(4.0)
    corners = [(5.0, 0.0), (5.0, 5.0), (0.0, 5.0)]
    assert flown.upload([waypoint(n, e, 4.0, acceptance_m=0.3) for n, e in corners]) == ACCEPTED
    assert flown.command(300) == ACCEPTED
    track = []
    while flown.mode == "MISSION":
        track.append(flown.run(0.04).position)
    for north, east in corners:
        nearest = np.linalg.norm(np.array(track) - [east, north, 4.0], axis=1).min()
        assert nearest < 0.4
    assert reached(flown) == [0, 1, 2]
    assert "Mission finished, loitering" in flown.texts
    assert flown.mode == "HOLD"
    assert flown.run(1.0).last("MISSION_CURRENT").seq == 2


def test_a_default_radius_cuts_the_corner():
    flown = Flown().take_off(4.0)
    flown.upload([waypoint(8.0, 0.0, 4.0), waypoint(8.0, 8.0, 4.0)])
    flown.command(300)
    flown.until(lambda: reached(flown) == [0], 20.0)
    assert 1.5 < 8.0 - flown.position[1] < 2.1


def test_starting_on_the_ground_arms_climbs_first_and_then_flies():
    flown = Flown().boot()
    flown.upload([waypoint(10.0, 0.0, 5.0), waypoint(10.0, 5.0, 5.0)])
    assert flown.command(300) == ACCEPTED
    flown.until(lambda: flown.position[1] > 0.5, 20.0)
    assert flown.height > 4.0
    assert flown.texts[:3] == ["Armed by mission start", "Executing Mission", "Climb to 5.0 meters above home"]
    flown.until(lambda: flown.mode == "HOLD", 30.0)


def test_a_take_off_item_counts_as_reached():
    flown = Flown().boot()
    flown.upload([(6, 22, 0, 0, 0, NAN, *place(0, 0), 4.0), waypoint(5.0, 0.0, 4.0)])
    flown.command(300)
    flown.until(lambda: flown.mode == "HOLD", 40.0)
    assert reached(flown) == [0, 1]


def test_speeds_hold_until_they_are_changed():
    flown = Flown().take_off(4.0)
    flown.upload([speed(1.0), waypoint(8.0, 0.0, 4.0, acceptance_m=0.3), speed(3.0), waypoint(40.0, 0.0, 4.0)])
    flown.command(300, -1)
    flown.until(lambda: flown.position[1] > 4.0, 20.0)
    assert flown.velocity[1] == pytest.approx(1.0, abs=0.1)
    flown.until(lambda: flown.position[1] > 25.0, 30.0)
    assert flown.velocity[1] == pytest.approx(3.0, abs=0.2)


def test_a_waypoint_is_held_as_long_as_it_says_and_the_heading_taken():
    flown = Flown().take_off(4.0)
    x, y = place(5.0, 0.0)
    flown.upload([(6, 16, 3.0, 0.5, 0.0, 90.0, x, y, 4.0), waypoint(5.0, 8.0, 4.0)])
    flown.command(300)
    flown.until(lambda: abs(flown.position[1] - 5.0) < 0.5, 20.0)
    assert flown.until(lambda: flown.position[0] > 1.0, 20.0) > 3.0
    assert flown.autopilot.snapshot.yaw_rad == pytest.approx(np.pi / 2, abs=0.3)


def test_delays_and_jumps():
    flown = Flown().take_off(4.0)
    flown.upload(
        [
            waypoint(4.0, 0.0, 4.0, acceptance_m=0.5),
            (2, 93, 2.0, -1.0, -1.0, -1.0, 0, 0, 0.0),
            waypoint(0.0, 0.0, 4.0, acceptance_m=0.5),
            (2, 177, 0.0, 2.0, 0.0, 0.0, 0, 0, 0.0),
        ]
    )
    flown.command(300)
    flown.until(lambda: flown.mode == "HOLD", 90.0)
    seqs = [m.seq for m in flown.messages("MISSION_CURRENT")]
    assert sum(1 for before, after in itertools.pairwise(seqs) if before != 0 and after == 0) == 2


def test_a_landing_ends_the_mission_and_keeps_its_mode():
    flown = Flown().boot()
    flown.upload([waypoint(4.0, 0.0, 4.0), land(4.0, 3.0)])
    flown.command(300)
    flown.until(lambda: not flown.armed and flown.time_s > 5.0, 60.0)
    assert np.allclose(flown.position, [3.0, 4.0, 0.0], atol=0.15)
    assert flown.texts[-3:] == ["Landing detected", "Mission finished, landed", "Disarmed by landing"]
    assert flown.mode == "MISSION"
    assert reached(flown) == [0, 1]


def test_a_return_item_becomes_the_return_mode():
    flown = Flown().boot()
    flown.upload([waypoint(4.0, 0.0, 4.0), RETURN])
    flown.command(300)
    flown.until(lambda: flown.mode == "RTL", 30.0)
    flown.until(lambda: not flown.armed, 60.0)
    assert np.allclose(flown.position, 0.0, atol=0.2)
    assert flown.mode == "MISSION"


def test_a_mission_swapped_in_flight_begins_at_its_first_item_without_a_stop():
    flown = Flown().take_off(4.0)
    flown.upload([waypoint(60.0, 0.0, 4.0), waypoint(80.0, 0.0, 4.0)])
    flown.command(300)
    flown.run(6.0)
    before = flown.last("MISSION_CURRENT").mission_id
    assert flown.upload([waypoint(60.0, 10.0, 4.0), waypoint(60.0, 40.0, 4.0)]) == ACCEPTED
    assert flown.mode == "MISSION"
    current = flown.last("MISSION_CURRENT")
    assert current.seq == 0
    assert current.mission_id != before
    slowest = min(float(np.linalg.norm(flown.run(0.1).velocity)) for _ in range(30))
    assert slowest > 3.0


def test_an_upload_in_offboard_does_not_leave_offboard():
    flown = Flown().take_off(4.0)
    flown.stream(position=(0.0, 0.0, -4.0)).offboard()
    assert flown.upload([waypoint(5.0, 0.0, 4.0)]) == ACCEPTED
    assert flown.mode == "OFFBOARD"
    flown.send(mavlink.MAVLink_mission_set_current_message(1, 1, 0), link=Link.ONBOARD)
    assert flown.run(0.1).mode == "OFFBOARD"


def test_the_current_item_is_told_at_once_on_both_links():
    flown = Flown().take_off(4.0)
    flown.upload([waypoint(5.0, 0.0, 4.0), waypoint(9.0, 0.0, 4.0)])
    flown.forget()
    flown.send(mavlink.MAVLink_mission_set_current_message(1, 1, 1))
    flown.run(0.04)
    assert [flown.last("MISSION_CURRENT", link=link).seq for link in Link] == [1, 1]
    flown.send(mavlink.MAVLink_mission_set_current_message(1, 1, 7))
    assert flown.run(0.04).texts[-1] == "WPM: WP CURR CMD: Not in list"


def test_hold_interrupts_a_mission_and_it_goes_on_where_it_was():
    flown = Flown().take_off(4.0)
    flown.upload([waypoint(5.0, 0.0, 4.0), waypoint(40.0, 0.0, 4.0)])
    flown.command(300)
    flown.until(lambda: reached(flown) == [0], 20.0)
    flown.command(176, 1, 4, 3)
    flown.run(8.0)
    assert np.linalg.norm(flown.velocity) < 0.2
    assert flown.command(300, -1) == ACCEPTED
    assert flown.run(1.0).last("MISSION_CURRENT").seq == 1
    flown.command(300, 0)
    assert flown.run(0.1).last("MISSION_CURRENT").seq == 0


@pytest.mark.parametrize("first", [-2.0, 5.0, NAN])
def test_a_start_at_an_item_that_is_not_there_is_denied(first):
    flown = Flown().boot()
    flown.upload([waypoint(5.0, 0.0, 4.0)])
    assert flown.command(300, first) == DENIED
    assert not flown.armed


def test_without_a_mission_there_is_nothing_to_start():
    flown = Flown().boot()
    assert flown.command(300) == DENIED
    assert flown.texts == ["Mission start denied! No valid mission"]


def test_clearing_the_mission_that_is_flown_ends_in_hold():
    flown = Flown().take_off(4.0)
    flown.upload([waypoint(50.0, 0.0, 4.0)])
    flown.command(300)
    flown.run(2.0)
    flown.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 0))
    flown.run(1.0)
    assert flown.mode == "HOLD"
    assert "No valid mission available, loitering" in flown.texts


def test_reached_items_are_repeated_for_ten_seconds():
    flown = Flown().take_off(4.0)
    flown.upload([waypoint(3.0, 0.0, 4.0)])
    flown.command(300)
    flown.until(lambda: reached(flown) == [0], 20.0)
    flown.run(15.0)
    assert len(flown.messages("MISSION_ITEM_REACHED")) == 11


def test_a_finished_mission_starts_over_after_landing():
    flown = Flown().boot()
    flown.upload([waypoint(3.0, 0.0, 3.0), land(3.0, 0.0)])
    for _ in range(2):
        assert flown.command(300, -1) == ACCEPTED
        flown.run(3.0)
        flown.until(lambda: not flown.armed, 60.0)
    assert flown.texts.count("Mission finished, landed") == 2


def test_a_mission_whose_first_waypoint_is_far_away_is_not_flown():
    flown = Flown().boot()
    assert flown.upload([waypoint(10_500.0, 0.0, 50.0)]) == ACCEPTED
    assert flown.texts == ["First waypoint too far away"]
    assert flown.command(300) == DENIED
