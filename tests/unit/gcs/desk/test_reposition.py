"""Where vehicles may be sent."""

import numpy as np
import pytest

from gcs.desk.reposition import why_not_there
from missions.mission import load_mission

INDOOR = load_mission("indoor")
NOBODY = np.zeros((0, 3))


def at(east_m: float, north_m: float, up_m: float = 1.5) -> np.ndarray:
    return np.array([east_m, north_m, up_m])


@pytest.mark.parametrize(
    ("to_m", "reason"),
    [
        (at(3, 3), None),
        (at(25, 7), "the place lies outside of the flight range"),
        (at(7, 7), "the place has 0.0 m clearance"),
        (at(11, 7), "something is in the straight way, at east"),
        (at(3, 3, 0.1), "the place is 0.1 m above the ground"),
    ],
)
def test_a_place_is_checked_against_range_obstacles_and_ground(to_m: np.ndarray, reason: str | None):
    found = why_not_there(INDOOR, at(2, 7), to_m, NOBODY)
    assert (found is None) if reason is None else found is not None and found.startswith(reason)


def test_a_vehicle_in_the_way_is_kept_away_from():
    found = why_not_there(INDOOR, at(2, 2), at(5, 2), at(4, 2.5)[None])
    assert found == "it would come within 0.5 m of another vehicle, required are 1 m"


def test_who_is_near_already_may_go_away():
    assert why_not_there(INDOOR, at(2, 2), at(2, 1.5), at(2, 2.8)[None]) is None
    assert why_not_there(INDOOR, at(5.9, 7), at(3, 7), NOBODY) is None  # 0.35 m from the crate
