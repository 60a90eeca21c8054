"""Who makes way, where to, and for how long."""

import numpy as np
import pytest

from companion.fleet.right_of_way import CALM_S, PATIENCE_S, Claim, RightOfWay, places_aside
from companion.fleet.roster import Said
from missions.trajectory import Trajectory, at_rest
from missions.tunnel import TrajectoryKind, TrajectoryMessage
from tests.unit.companion.fleet.talk import line

HERE_M = np.array([5.0, 5.0, 1.5])
THROUGH = line((1, 5, 1.5), (9, 5, 1.5), 0.0)
BESIDE = line((1, 9, 1.5), (9, 9, 1.5), 0.0)
APART_M = 1.0


def wanted(sysid: int, path: Trajectory = THROUGH, rank: int = 0) -> list[tuple[int, Said]]:
    message = TrajectoryMessage(
        kind=TrajectoryKind.WANTED, plan_id=1, revision=1, radius_m=0.2, trajectory=path, rank=rank
    )
    return [(sysid, Said(message, path, 0.0))]


def looked(
    right: RightOfWay, claims: list[tuple[int, Said]], now_s: float = 0.0, *, idle: bool = False
) -> Claim | None:
    right.look(claims, at_rest(HERE_M, 0.0), APART_M, now_s, idle=idle)
    return right.claim


@pytest.mark.parametrize(
    ("own", "other", "rank", "idle", "yields"),
    [
        (2, 1, 0, False, True),
        (1, 2, 0, False, False),
        (1, 2, 0, True, True),
        (3, 4, 2, False, True),  # 4 makes way for 2 itself
        (2, 4, 3, False, False),
    ],
)
def test_the_larger_id_makes_way_and_so_does_who_is_idle(own: int, other: int, rank: int, idle: bool, yields: bool):
    assert (looked(RightOfWay(own), wanted(other, rank=rank), idle=idle) is not None) == yields


def test_whoever_is_not_in_the_way_stays():
    assert looked(RightOfWay(2), wanted(1, BESIDE)) is None


def test_of_two_that_want_through_the_smaller_rank_counts():
    claim = looked(RightOfWay(9), wanted(5) + wanted(3))
    assert claim is not None
    assert claim.sysid == 3


def test_who_makes_way_has_the_rank_of_whom_it_makes_way_for_until_it_is_calm():
    right = RightOfWay(7)
    looked(right, wanted(2), 10.0)
    assert right.rank == 2
    right.look(wanted(2), at_rest(np.array([5.0, 8.0, 1.5]), 0.0), APART_M, 11.0, idle=False)
    assert right.claim is not None, "out of the way, and waiting"
    looked(right, [], 11.0 + CALM_S - 0.1)
    assert right.rank == 2
    looked(right, [], 11.0 + CALM_S + 0.1)
    assert (right.claim, right.rank) == (None, 7)


def test_without_a_path_for_a_while_it_is_stuck_and_not_before_nor_elsewhere():
    right = RightOfWay(1)
    times_s = np.arange(100.0, 100.0 + PATIENCE_S + 0.3, 0.1)
    stuck = []
    for time_s in times_s:
        right.note_no_path(HERE_M, time_s)
        stuck.append(right.is_stuck(time_s))
    assert stuck == sorted(stuck)
    assert (stuck[0], stuck[-1]) == (False, True)
    right.note_no_path(HERE_M + [1.0, 0.0, 0.0], times_s[-1])
    assert not right.is_stuck(times_s[-1])


def test_a_path_that_was_found_is_forgotten_trouble():
    right = RightOfWay(1)
    for time_s in (100.0, 100.5, 101.5):
        right.note_no_path(HERE_M, time_s)
    assert right.is_stuck(101.5)
    assert not right.is_stuck(105.0)


def test_who_has_just_made_way_is_more_patient():
    right = RightOfWay(7)
    looked(right, wanted(2), 100.0)
    looked(right, [], 102.0)
    for time_s in (102.0, 102.5, 103.5):
        right.note_no_path(HERE_M, time_s)
    assert not right.is_stuck(103.5)
    for time_s in (104.5, 105.5):
        right.note_no_path(HERE_M, time_s)
    assert right.is_stuck(105.5)


def test_places_aside_are_off_the_path_near_ones_first_and_back_along_the_trail():
    claim = Claim(1, 1, THROUGH.sample(np.linspace(0.0, 4.0, 24)).position_m)
    trail_m = np.array([[5.0, north_m, 1.5] for north_m in (20.0, 15.0, 5.2)])
    places_m = places_aside(claim, HERE_M, trail_m, APART_M)
    off_m = np.linalg.norm(places_m - HERE_M, axis=1)
    assert claim.distance_m(places_m).min() > APART_M
    assert off_m.tolist() == sorted(off_m)
    assert off_m[0] < 2.0
    assert [5.0, 20.0, 1.5] in places_m.tolist()
    assert [5.0, 5.2, 1.5] not in places_m.tolist()
