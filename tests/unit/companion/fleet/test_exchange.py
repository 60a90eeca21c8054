"""What vehicles know of each other's plans, over good links and bad ones."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from companion.fleet.exchange import Exchange
from companion.fleet.motion import with_lead_in
from companion.fleet.reports import PlanReport, PositionReport, Report
from missions.trajectory import Trajectory, at_rest
from missions.tunnel import TrajectoryKind
from tests.unit.companion.fleet.talk import BEGIN_S, ROOM, Air, line

COMMITTED, OPTIMISED, BRAKING = TrajectoryKind.COMMITTED, TrajectoryKind.OPTIMISED, TrajectoryKind.BRAKING


def flying(air: Air, number: int = 0, kind: TrajectoryKind = COMMITTED) -> Trajectory:
    """A vehicle flies a line from now on."""
    trajectory = line((2, 3, 1.5), (10, 3, 1.5), air.time_s(number))
    air.exchanges[number].fly(kind, trajectory, 7, 0, air.time_s(number))
    air.paths[number] = trajectory
    return trajectory


def hovering(air: Air, number: int = 0) -> Trajectory:
    """A vehicle hovers at (4, 3 + 2 number, 1.5), under a plan."""
    there = at_rest(np.array([4.0, 3.0 + 2.0 * number, 1.5]), air.time_s(number))
    air.exchanges[number].fly(COMMITTED, there, 7, 0, air.time_s(number))
    air.paths[number] = there
    return there


def test_a_plan_is_known_to_the_others_on_their_own_clocks():
    air = Air(3)
    trajectory = flying(air)
    air.run(0.1)
    for number in (1, 2):
        (other, *_) = air.exchanges[number].neighbours(air.time_s(number))
        assert (other.sysid, other.kind, other.radius_m) == (1, COMMITTED, ROOM.limits.body_radius_m)
        for ahead_s in (0.0, 1.0, 3.0, 9.0):
            there = other.trajectory.at(air.time_s(number) + ahead_s).position_m
            np.testing.assert_allclose(there, trajectory.at(air.time_s(0) + ahead_s).position_m, atol=0.01)


def test_who_is_alone_does_not_wait_and_knows_nobody():
    air = Air(1)
    flying(air)
    air.run(1.0)
    assert air.exchanges[0].wait_s(air.time_s(0)) == 0.0
    assert air.exchanges[0].neighbours(air.time_s(0)) == ()


@pytest.mark.parametrize(("delay_s", "jitter_s"), [(0.0, 0.0), (0.1, 0.0), (0.3, 0.2)])
def test_the_wait_is_longer_than_any_word_takes_and_not_much_longer(delay_s: float, jitter_s: float):
    air = Air(2, delay_s=delay_s, jitter_s=jitter_s)
    flying(air)
    air.run(6.0)
    wait_s = air.exchanges[1].wait_s(air.time_s(1))
    assert delay_s + 0.9 * jitter_s < wait_s < delay_s + jitter_s + 0.13


def test_a_wait_becomes_shorter_again_with_the_link():
    air = Air(2, delay_s=0.5)
    air.run(3.0)
    air.delay_s = 0.0
    air.run(12.0)
    assert air.exchanges[0].wait_s(air.time_s(0)) < 0.1


def test_a_plan_that_begins_later_is_led_in_by_what_is_flown_until_then():
    air = Air(2)
    first = flying(air)
    air.run(1.0)
    now_s = air.time_s(0)
    start_s = now_s + 0.4
    place, velocity, acceleration = first.at(start_s)
    knot_s = 0.4
    begin = np.array(
        [
            place - velocity * knot_s + acceleration * knot_s**2 / 3.0,
            place - acceleration * knot_s**2 / 6.0,
            place + velocity * knot_s + acceleration * knot_s**2 / 3.0,
        ]
    )
    second = Trajectory(np.vstack((begin, [[8, 4, 1.5]] * 4, [[9, 5, 1.5]] * 3)), start_s, knot_s)
    air.exchanges[0].fly(COMMITTED, second, 7, 0, now_s)
    air.paths[0] = with_lead_in(second, first, now_s, most_points=14)
    air.run(0.1)
    (other,) = (n for n in air.exchanges[1].neighbours(air.time_s(1)) if n.sysid == 1)
    for ahead_s in (-0.1, 0.0, 0.1, 0.2, 0.29, 1.0, 5.0):
        expected = (first if air.time_s(0) + ahead_s < start_s else second).at(air.time_s(0) + ahead_s).position_m
        np.testing.assert_allclose(other.trajectory.at(air.time_s(1) + ahead_s).position_m, expected, atol=0.03)


def test_an_offer_is_not_what_is_flown_and_is_forgotten_when_nothing_comes_of_it():
    air = Air(2)
    flown = hovering(air)
    air.run(0.2)
    now_s = air.time_s(0)
    air.exchanges[0].offer(line((4, 3, 1.5), (4, 9, 1.5), now_s + 0.3), 7, 0, now_s)
    air.run(0.1)
    kinds = [n.kind for n in air.exchanges[1].neighbours(air.time_s(1), pending=True)]
    assert kinds == [COMMITTED, OPTIMISED]
    assert [n.kind for n in air.exchanges[1].neighbours(air.time_s(1))] == [COMMITTED]
    air.exchanges[0].withdraw()
    air.run(2.0)
    (other,) = air.exchanges[1].neighbours(air.time_s(1), pending=True)
    np.testing.assert_allclose(other.trajectory.end_m, flown.end_m, atol=0.01)


def test_an_offer_that_is_committed_replaces_what_was_flown():
    air = Air(2)
    hovering(air)
    air.run(0.2)
    now_s = air.time_s(0)
    air.exchanges[0].offer(line((4, 3, 1.5), (4, 9, 1.5), now_s), 7, 0, now_s)
    air.run(0.1)
    air.exchanges[0].commit_offer()
    air.paths[0] = line((4, 3, 1.5), (4, 9, 1.5), now_s)
    air.run(0.1)
    (other,) = air.exchanges[1].neighbours(air.time_s(1), pending=True)
    assert other.kind is COMMITTED
    np.testing.assert_allclose(other.trajectory.end_m, (4, 9, 1.5), atol=0.01)


def test_of_two_offers_the_earlier_is_respected_and_the_later_is_not():
    air = Air(2, delay_s=0.1)
    air.run(1.0)
    first, second = air.exchanges
    first.offer(line((2, 3, 1.5), (9, 3, 1.5), air.time_s(0)), 7, 0, air.time_s(0))
    air.run(0.04)
    second.offer(line((9, 3, 1.5), (2, 3, 1.5), air.time_s(1)), 7, 0, air.time_s(1))
    air.run(0.14)
    assert [n.kind for n in first.neighbours(air.time_s(0), pending=True)] == [COMMITTED], "where it hovers"
    assert OPTIMISED in [n.kind for n in second.neighbours(air.time_s(1), pending=True)]


def test_two_offers_of_one_moment_are_ordered_by_system_id():
    air = Air(2)
    air.run(1.0)
    for number, exchange in enumerate(air.exchanges):
        exchange.offer(line((2, 3, 1.5), (9, 3, 1.5), air.time_s(number)), 7, 0, air.time_s(number))
    air.run(0.1)
    respected = [
        OPTIMISED in [n.kind for n in exchange.neighbours(air.time_s(number), pending=True)]
        for number, exchange in enumerate(air.exchanges)
    ]
    assert respected == [False, True]


def test_overtaken_and_repeated_messages_change_nothing():
    air = Air(2)
    old = flying(air)
    (first,) = (r for r in air.exchanges[0].tick(None, air.time_s(0)) if isinstance(r, PlanReport))
    air.run(0.5)
    newer = line((10, 3, 1.5), (3, 9, 1.5), air.time_s(0))
    air.exchanges[0].fly(BRAKING, newer, 7, 0, air.time_s(0))
    air.paths[0] = newer
    air.run(0.1)
    before = air.exchanges[1].roster.changes
    for _ in range(3):
        air.exchanges[1].hear(first, air.time_s(1))
    (other, *_) = air.exchanges[1].neighbours(air.time_s(1))
    assert (other.kind, air.exchanges[1].roster.changes) == (BRAKING, before)
    assert air.exchanges[1].roster.dropped["overtaken"] == 3
    assert not np.allclose(other.trajectory.end_m, old.end_m)


def test_a_companion_that_was_started_anew_is_believed_though_it_counts_from_one():
    air = Air(2)
    for _ in range(5):
        flying(air)
        air.run(0.1)
    fresh = Exchange(1, ROOM)
    fresh.utc_ahead_s = air.exchanges[0].utc_ahead_s
    air.exchanges[0] = fresh
    trajectory = line((3, 3, 1.5), (3, 12, 1.5), air.time_s(0))
    fresh.fly(COMMITTED, trajectory, 7, 0, air.time_s(0))
    air.paths[0] = trajectory
    air.run(0.1)
    (other, *_) = air.exchanges[1].neighbours(air.time_s(1))
    np.testing.assert_allclose(other.trajectory.end_m, (3, 12, 1.5), atol=0.01)


def test_who_falls_silent_grows_is_never_dropped_and_does_not_fill_the_room():
    air = Air(2)
    flying(air)
    air.run(0.5)
    air.loss = 1.0
    others = []
    for _ in range(12):
        air.run(1.0)
        others += air.exchanges[1].neighbours(air.time_s(1))
    radii = [other.radius_m for other in others]
    assert len(others) == 12
    body_m = ROOM.limits.body_radius_m
    assert radii == sorted(radii)
    assert radii[0] == body_m < radii[3]
    assert radii[-1] == body_m + 0.75
    assert others[-1].distance_m(ROOM.limits) == ROOM.limits.separation_m + 0.75


def test_who_does_not_fly_what_it_said_is_where_it_says_it_is():
    air = Air(2)
    flying(air)
    del air.paths[0]
    air.places[0] = np.array([2.0, 3.0, 1.5])
    air.run(2.0)  # by its plan it should be metres away by now
    (other,) = air.exchanges[1].neighbours(air.time_s(1))
    np.testing.assert_allclose(other.trajectory.at(air.time_s(1)).position_m, (2, 3, 1.5), atol=0.05)


def test_a_plan_that_is_not_spoken_of_any_more_gives_way_to_a_position():
    air = Air(2)
    flying(air)
    air.run(0.5)
    air.exchanges[0].end()
    del air.paths[0]
    air.places[0] = np.array([4.0, 4.0, 0.2])
    air.run(2.5)
    (other,) = air.exchanges[1].neighbours(air.time_s(1))
    np.testing.assert_allclose(other.trajectory.end_m, (4, 4, 0.2), atol=0.05)


def position(sysid: int = 9, **changes: object) -> PositionReport:
    report = PositionReport(sysid, None, np.array([5.0, 5.0, 1.5]), np.array([1.0, 0.0, 0.0]), 0.3, on_ground=False)
    return replace(report, **changes)


def test_a_vehicle_without_plans_is_expected_to_go_straight_on_and_then_to_rest():
    air = Air(1)
    air.exchanges[0].hear(position(), air.time_s(0))
    (other,) = air.exchanges[0].neighbours(air.time_s(0))
    assert other.radius_m == pytest.approx(ROOM.limits.body_radius_m + 0.3)
    for ahead_s in (0.0, 0.5, 1.5):
        there = other.trajectory.at(air.time_s(0) + ahead_s).position_m
        np.testing.assert_allclose(there, (5.0 + ahead_s, 5.0, 1.5), atol=1e-6)
    assert 2.0 < other.trajectory.end_m[0] - 5.0 <= 3.0
    assert np.linalg.norm(other.trajectory.at(air.time_s(0) + 4.0).velocity_m_s) == 0.0
    air.run(2.0)
    assert air.exchanges[0].neighbours(air.time_s(0))[0].radius_m > other.radius_m


def test_a_vehicle_on_the_ground_stays_there():
    air = Air(1)
    air.exchanges[0].hear(position(on_ground=True), air.time_s(0))
    air.run(30.0)
    (other,) = air.exchanges[0].neighbours(air.time_s(0))
    np.testing.assert_allclose(other.trajectory.end_m, (5, 5, 1.5))
    assert other.radius_m == pytest.approx(ROOM.limits.body_radius_m + 0.3)


def plan_report(air: Air, sysid: int = 2, **changes: object) -> PlanReport:
    """What vehicle 2 of the air would say now."""
    sender = Exchange(sysid, ROOM)
    sender.utc_ahead_s = BEGIN_S
    sender.fly(COMMITTED, line((5, 5, 1.5), (9, 5, 1.5), air.now_s), 7, 0, air.now_s)
    (report,) = sender.tick(None, air.now_s)
    assert isinstance(report, PlanReport)
    return replace(report, message=msgspec.structs.replace(report.message, **changes))


LATER = line((5, 5, 1.5), (9, 5, 1.5), BEGIN_S + 5000.0)
FAR = line((5000, 5, 1.5), (5004, 5, 1.5), BEGIN_S)
FAST = line((5, 5, 1.5), (15, 5, 1.5), BEGIN_S, lasts_s=0.2)


@pytest.mark.parametrize(
    ("report", "reason"),
    [
        (plan_report(Air(1), 1), "our own system id"),
        (plan_report(Air(1), 251), "no system id of a vehicle"),
        (plan_report(Air(1), 0), "no system id of a vehicle"),
        (plan_report(Air(1), announced_s=BEGIN_S + 0.2), "another clock"),
        (plan_report(Air(1), announced_s=BEGIN_S - 100.0), "another clock"),
        (plan_report(Air(1), trajectory=LATER), "another time"),
        (plan_report(Air(1), trajectory=FAR), "far away"),
        (plan_report(Air(1), trajectory=FAST), "too fast"),
        (position(position_m=np.array([np.nan, 0.0, 0.0])), "no position"),
        (position(velocity_m_s=np.array([np.inf, 0.0, 0.0])), "no position"),
        (position(error_m=np.nan), "no position"),
        (position(position_m=np.array([1e5, 0.0, 0.0])), "far away"),
        (position(velocity_m_s=np.array([90.0, 0.0, 0.0])), "too fast"),
        (position(sysid=1), "our own system id"),
    ],
)
def test_what_cannot_be_true_is_counted_and_dropped(report: Report, reason: str):
    air = Air(1)
    air.exchanges[0].hear(report, air.time_s(0))
    assert air.exchanges[0].roster.dropped == {reason: 1}
    assert air.exchanges[0].neighbours(air.time_s(0), pending=True) == ()


def test_the_same_reports_untouched_are_believed():
    air = Air(1)
    air.exchanges[0].hear(plan_report(air), air.time_s(0))
    air.exchanges[0].hear(position(), air.time_s(0))
    assert [n.sysid for n in air.exchanges[0].neighbours(air.time_s(0))] == [2, 9]
    assert not air.exchanges[0].roster.dropped


def test_without_a_common_clock_plans_are_neither_told_nor_believed_and_positions_are_both():
    air = Air(2)
    air.exchanges[1].utc_ahead_s = None
    paths = [hovering(air, number) for number in (0, 1)]
    air.run(1.0)
    assert air.exchanges[1].roster.dropped["no common clock"] > 0
    for exchange, number in ((air.exchanges[0], 0), (air.exchanges[1], 1)):
        (other,) = exchange.neighbours(air.time_s(number))
        np.testing.assert_allclose(other.trajectory.end_m, paths[1 - number].end_m, atol=0.05)
    assert air.exchanges[1].wait_s(air.time_s(1)) == 0.0


def test_clocks_that_differ_by_what_gnss_allows_are_good_enough():
    air = Air(2, clock_errors_s=(0.04, 0.0))
    trajectory = flying(air)
    air.run(0.1)
    (other, *_) = air.exchanges[1].neighbours(air.time_s(1))
    there = other.trajectory.at(air.time_s(1) + 2.0).position_m
    assert np.linalg.norm(there - trajectory.at(air.time_s(0) + 2.0).position_m) < 0.04 * 4.0
    assert not air.exchanges[1].roster.dropped


def test_a_flood_of_invented_vehicles_fills_neither_memory_nor_the_planner():
    air = Air(1)
    flying(air)
    rng = np.random.default_rng(3)
    for _ in range(3000):
        sysid = int(rng.integers(0, 256))
        air.exchanges[0].hear(position(sysid, position_m=rng.uniform(0, 15, 3)), air.time_s(0))
        air.exchanges[0].hear(plan_report(air, sysid), air.time_s(0))
    assert len(air.exchanges[0].roster.known) <= 250
    heard = air.exchanges[0].neighbours(air.time_s(0), pending=True)
    assert len(heard) == 24
    here_m = np.array([2.0, 3.0, 1.5])
    off_m = [np.linalg.norm(n.trajectory.at(air.time_s(0)).position_m - here_m) for n in heard]
    assert off_m == sorted(off_m)
