"""Which targets of its route a vehicle has come to."""

import numpy as np

from gcs.dialect import Mode
from gcs.fleet.vehicle_state import LandedState
from gcs.flight.monitor import Phase
from gcs.flight.route import RouteWatch, segment_distance_m
from missions.mission import OnArrival, Target
from tests.unit.gcs.test_monitor import TARGET, Flight

WINDOW = Target(name="window", position_m=(10.0, 3.0, 1.5))
DOOR = Target(name="door", position_m=(14.0, 3.0, 1.5))


def watch(*stops: Target, items: tuple[int, ...] = ()) -> RouteWatch:
    return RouteWatch(stops, 0.5, items)


def at(east_m: float, north_m: float = 3.0) -> np.ndarray:
    return np.array([east_m, north_m, 1.5])


def test_a_target_between_two_positions_has_been_passed():
    route = watch(WINDOW, DOOR)
    route.see(at(9.0), 1.0, 0)
    route.see(at(11.5, 3.4), 1.4, 0)
    assert route.missed == ["door"]


def test_a_target_that_was_left_aside_is_missed():
    route = watch(WINDOW)
    route.see(at(9.0, 4.0), 1.0, 0)
    route.see(at(11.0, 4.0), 1.4, 5)
    assert route.missed == ["window"]


def test_after_a_gap_the_missions_own_count_says_what_was_passed():
    route = watch(WINDOW, DOOR, items=(2, 6))
    route.see(at(5.0, 4.0), 1.0, 0)
    route.see(at(13.0, 6.0), 9.0, 3)
    assert route.missed == ["door"]


def test_distance_to_a_line_that_ends():
    assert segment_distance_m(np.zeros(3), at(1.0), at(1.0)) == np.linalg.norm(at(1.0))
    np.testing.assert_allclose(
        segment_distance_m(np.array([0.0, 0, 0]), np.array([-1.0, 2, 0]), np.array([1.0, 2, 0])), 2
    )


def fly_by(*places: np.ndarray, on_arrival: OnArrival = OnArrival.LAND) -> Flight:
    """Along these places to the last target, and down there."""
    flight = Flight(on_arrival=on_arrival)
    flight.monitor.route = watch(WINDOW)
    for place_m in (*places, np.array(TARGET.position_m)):
        flight.at(place_m)
        flight.wait(0.3)
    flight.state.mode, flight.state.landed, flight.state.armed = Mode.LAND, LandedState.ON_GROUND, False
    flight.at([TARGET.position_m[0], TARGET.position_m[1], 0.0])
    flight.wait(0.2)
    return flight


def test_a_flight_that_came_to_all_its_targets_is_a_success():
    monitor = fly_by(at(9.0), at(11.0)).monitor
    assert (monitor.phase, monitor.reached, monitor.reason) == (Phase.DONE, True, "landed at its target")


def test_a_flight_that_left_a_target_out_is_none_and_says_which():
    monitor = fly_by(at(9.0, 6.0), at(11.0, 6.0)).monitor
    assert (monitor.phase, monitor.reached) == (Phase.DONE, False)
    assert monitor.reason == "landed at its target, but never came to window"
