"""How the flights of all shipped missions are judged."""

import numpy as np
import pytest

from gcs.flight.report import Flown
from missions.mission import load_mission
from tests.experiments.missions.experiment import MISSIONS, separation_m, shortfalls, summary

TERRAIN = load_mission("terrain-1-5uav")


def standing_at(place_m: tuple[float, float, float]) -> Flown:
    return Flown(np.arange(3.0), np.tile(place_m, (3, 1)), np.zeros((3, 3)))


@pytest.mark.parametrize(
    ("other_m", "expected_m"),
    [((400.0, 0.0, 50.0), 100.0), ((400.0, 0.0, 0.0), np.inf), ((100.0, 0.0, 50.0), 200.0)],
    ids=["both fly", "one is on the ground", "one has not left the launch zone"],
)
def test_separation_is_that_of_vehicles_in_the_air_of_which_one_has_left_the_launch_zone(other_m, expected_m):
    assert separation_m(TERRAIN, [standing_at((300.0, 0.0, 50.0)), standing_at(other_m)]) == pytest.approx(expected_m)


def test_in_the_launch_zone_separation_rests():
    near = [standing_at((10.0 * index, 0.0, 10.0)) for index in range(3)]
    assert separation_m(TERRAIN, near) == np.inf


def row(**values: object) -> dict:
    fine = {"seed": 0, "mission": MISSIONS[0], "success": True, "separation_share": 1.1, "separation_m": 1.1}
    return {**fine, "reason": "", **values}


def test_a_flight_that_fails_or_comes_too_near_is_named_and_no_other():
    assert shortfalls([row(), row(separation_share=None, separation_m=None)]) == []
    assert shortfalls([row(success=False, reason="alpha: lost")]) == [f"{MISSIONS[0]}, seed 0: alpha: lost"]
    assert shortfalls([row(separation_share=0.7, separation_m=0.7)]) == [
        f"{MISSIONS[0]}, seed 0: vehicles were 0.7 m apart"
    ]


def test_the_summary_has_a_row_for_every_mission_that_was_flown():
    figures = ("flight_s", "path_m", "clearance_m", "tracking_p99_m", "cloud_replans")
    measured = dict.fromkeys(figures, 1.0) | {"vehicles": 2, "onboard_replans": 4, "simulated_s": 20.0, "wall_s": 2.0}
    text = summary([row(**measured), row(**measured, mission="terrain-3-10uav", success=False, reason="echo: lost")])
    assert text.count("\n| ") == 3, text
    assert "* terrain-3-10uav, seed 0: echo: lost" in text
