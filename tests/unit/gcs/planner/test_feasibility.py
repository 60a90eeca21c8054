"""The judge finds every breach, names it, and finds none where there is none."""

import dataclasses
from collections.abc import Callable

import msgspec
import numpy as np
import pytest

from gcs.planner import feasibility
from gcs.planner.plan import Limit, TimedCurve, Violation
from missions.mission import Mission, Target, load_mission
from missions.world import Peak, Point3, Threat
from tests.unit.gcs.planner.worlds import room, wall

SPEED_M_S = 2.0


def flown(mission: Mission, lines: list[Callable[[np.ndarray], np.ndarray]], count: int = 1200) -> list[TimedCurve]:
    """Curves given as functions of (m, 1) shares of the way, all passed evenly in the same time."""
    share = np.linspace(0.0, 1.0, count)[:, None]
    curves_m = [line(share) for line in lines]
    length_m = max(float(np.linalg.norm(np.diff(curve, axis=0), axis=1).sum()) for curve in curves_m)
    return [
        TimedCurve(vehicle.name, vehicle.sysid, (target,), curve, share[:, 0] * length_m / SPEED_M_S)
        for vehicle, target, curve in zip(mission.vehicles, mission.targets, curves_m, strict=True)
    ]


def straight(begin, end) -> Callable[[np.ndarray], np.ndarray]:
    return lambda share: np.asarray(begin) + share * np.subtract(end, begin)


def straight_room(**changes: object) -> tuple[Mission, list[TimedCurve]]:
    """Two vehicles side by side through an empty room."""
    mission = room(**changes)
    return mission, flown(mission, [straight((1, 6, 1.5), (19, 6, 1.5)), straight((1, 8, 1.5), (19, 8, 1.5))])


def found(mission: Mission, curves: list[TimedCurve]) -> dict[Limit, Violation]:
    return {violation.limit: violation for violation in feasibility.violations(mission, curves)}


def test_two_straight_flights_through_an_empty_room_are_feasible():
    assert feasibility.violations(*straight_room()) == ()


def test_a_wall_across_the_way_is_found_where_it_stands():
    mission, curves = straight_room(boxes=wall(10.0, (7.0, 14.0)))
    breach = found(mission, curves)[Limit.CLEARANCE]
    assert breach.vehicle == "v1"
    assert breach.found == pytest.approx(-0.15, abs=0.01)
    assert breach.required == 0.6
    assert str(breach) == ("v1: clearance -0.142 m at (10.0, 6.0, 1.5) m, 4.5 s after T0, required is at least 0.6 m")


def test_a_threat_is_no_less_an_obstacle():
    mission, curves = straight_room()
    threats = (Threat(name="jammer", centre_m=(10.0, 6.0), radius_m=1.2),)
    world = msgspec.structs.replace(mission.world, threats=threats)
    breach = found(msgspec.structs.replace(mission, world=world), curves)[Limit.CLEARANCE]
    assert breach.found == pytest.approx(0.3, abs=0.01)


def test_what_is_not_known_is_not_judged():
    mission, curves = straight_room(boxes=tuple(msgspec.structs.replace(box, known=False) for box in wall(10.0, None)))
    assert feasibility.violations(mission, curves) == ()


def test_flying_too_low_over_a_hill_is_found():
    mission, curves = straight_room()
    peaks = (Peak(name="hill", centre_m=(10.0, 3.5), radius_m=6.0, height_m=3.0),)
    world = msgspec.structs.replace(mission.world, peaks=peaks)
    breach = found(msgspec.structs.replace(mission, world=world), curves)[Limit.HEIGHT]
    assert 0.0 < breach.found < 0.5
    assert breach.found == pytest.approx(1.5 - 3.0 * 0.01 ** (2.5**2 / 36.0), abs=0.01)


def test_leaving_the_room_is_found_and_so_is_flying_along_its_wall():
    mission = room(pads_m=((1.0, 6.0, 0.0),), targets_m=((19.0, 6.0, 1.5),))

    def bow(to_m: float):
        return lambda share: np.hstack((1 + 18 * share, 6 + to_m * 4 * share * (1 - share), 1.5 + 0 * share))

    assert found(mission, flown(mission, [bow(8.6)])) == {}
    breach = found(mission, flown(mission, [bow(8.9)]))[Limit.BOUNDS]
    assert breach.found == pytest.approx(0.2, abs=0.01)
    assert Limit.BOUNDS in found(mission, flown(mission, [bow(9.5)]))


def test_outdoors_the_whole_flight_range_may_be_used():
    mission = load_mission("field")
    mission = msgspec.structs.replace(mission, world=msgspec.structs.replace(mission.world, boxes=()))

    def bow(to_m: float):
        return lambda share: np.hstack((60 * share, to_m * 4 * share * (1 - share), 5 + 3 * share))

    assert found(mission, flown(mission, [bow(39.9)])) == {}
    assert Limit.BOUNDS in found(mission, flown(mission, [bow(40.1)]))


def test_too_tight_a_turn_is_found():
    mission = room(pads_m=((9.0, 7.0, 0.0),), targets_m=((11.0, 7.0, 1.5),), turn_radius_m=1.05)

    def half_circle(share):
        return np.hstack((10 - np.cos(np.pi * share), 7 + np.sin(np.pi * share), 1.5 + 0 * share))

    breach = found(mission, flown(mission, [half_circle]))[Limit.TURN_RADIUS]
    assert breach.found == pytest.approx(1.0, abs=1e-3)


def test_too_steep_a_climb_is_found():
    mission = room(pads_m=((1.0, 6.0, 0.0),), targets_m=((4.0, 6.0, 3.5),))
    breach = found(mission, flown(mission, [straight((1, 6, 1.5), (4, 6, 3.5))]))[Limit.CLIMB_ANGLE]
    assert (breach.found, breach.required) == (pytest.approx(33.69, abs=0.01), 30.0)


def test_too_long_a_path_and_too_long_a_flight_are_found():
    mission, curves = straight_room(range_m=17.0, endurance_s=8.0)
    breaches = found(mission, curves)
    assert (breaches[Limit.RANGE].found, breaches[Limit.ENDURANCE].found) == (pytest.approx(18.0), pytest.approx(9.0))


def test_bounds_of_the_mean_separation_are_kept_apart():
    assert Limit.LEAST_MEAN_SEPARATION in found(*straight_room(mean_separation_m=(2.5, 20.0)))
    assert Limit.GREATEST_MEAN_SEPARATION in found(*straight_room(mean_separation_m=(0.5, 1.5)))


def test_ends_that_are_not_start_and_target_are_found():
    mission, _ = straight_room()
    curves = flown(mission, [straight((1.1, 6, 1.5), (19, 6, 1.5)), straight((1, 8, 1.5), (19, 8, 1.7))])
    breaches = found(mission, curves)
    assert (breaches[Limit.START].vehicle, breaches[Limit.TARGET].vehicle) == ("v1", "v2")


def test_a_target_on_the_way_that_is_missed_or_passed_too_late_is_found():
    mission, curves = straight_room()
    by = {name: Target(name=name, position_m=place) for name, place in
          {"on": (10.0, 6.0, 1.5), "beside": (10.0, 6.3, 1.5), "before": (4.0, 6.0, 1.5)}.items()}  # fmt: skip

    def passing(*names: str) -> dict[Limit, Violation]:
        targets = (*(by[name] for name in names), *curves[0].targets)
        return found(mission, [dataclasses.replace(curves[0], targets=targets), curves[1]])

    assert passing("before", "on") == {}
    breach = passing("beside")[Limit.ROUTE]
    assert (breach.vehicle, breach.found) == ("v1", pytest.approx(0.3, abs=0.01))
    assert breach.where.startswith("(beside) at (10.0, 6.0, 1.5) m")
    assert passing("on", "before")[Limit.ROUTE].found == pytest.approx(6.0, abs=0.1)


def crossing() -> tuple[Mission, list[TimedCurve]]:
    """Two vehicles whose paths cross; the second is there 2.5 s, or 5 m, after the first."""
    mission = room(pads_m=((1.0, 6.0, 0.0), (6.0, 2.0, 0.0)), targets_m=((19.0, 6.0, 1.5), (6.0, 14.0, 1.5)))

    def detour(share):
        return np.hstack((6 + 0 * share, 2 + 12 * share**1.5, 1.5 + 0 * share))

    return mission, flown(mission, [straight((1, 6, 1.5), (19, 6, 1.5)), detour])


def test_separation_is_judged_at_the_same_time_without_time_slack():
    mission, curves = crossing()
    assert Limit.SEPARATION not in found(with_slack(mission, 0.0), curves)


def test_with_time_slack_separation_holds_when_one_is_early_or_late():
    mission, curves = crossing()
    breach = found(with_slack(mission, 2.0), curves)[Limit.SEPARATION]
    assert breach.found < 0.1
    assert "to v2" in breach.where
    assert "s later" in breach.where
    assert found(with_slack(mission, 0.5), curves).get(Limit.SEPARATION) is None


def with_slack(mission: Mission, slack_s: float) -> Mission:
    return msgspec.structs.replace(mission, planner=msgspec.structs.replace(mission.planner, time_slack_s=slack_s))


def test_near_the_launch_point_separation_rests_but_contact_does_not():
    terrain = load_mission("terrain-1-5uav")
    world = msgspec.structs.replace(terrain.world, peaks=(), threats=())
    near = msgspec.structs.replace(terrain.limits, mean_separation_m=(0.0, 1e6))
    targets = tuple(
        msgspec.structs.replace(target, position_m=place)
        for target, place in zip(terrain.targets[:2], ((600.0, 160.0, 100.0), (600.0, 40.0, 100.0)), strict=True)
    )
    mission = msgspec.structs.replace(terrain, world=world, limits=near, vehicles=terrain.vehicles[:2], targets=targets)
    apart = [straight((0, 0, 0), (600, 160, 100)), straight((0, 0, 0), (600, 40, 100))]
    assert feasibility.violations(mission, flown(mission, apart)) == ()

    def together_at_first(side: float):
        def line(share):
            return np.hstack((600 * share, 100 * share + side * 60 * np.maximum(share - 0.1, 0.0) / 0.9, 100 * share))

        return line

    breach = found(mission, flown(mission, [together_at_first(1), together_at_first(-1)]))[Limit.SEPARATION]
    assert (breach.found, breach.required) == (pytest.approx(0.0), pytest.approx(0.4))


def test_vehicles_that_change_sides_between_their_pads_and_their_curves_are_found():
    terrain = load_mission("terrain-1-5uav")
    near = msgspec.structs.replace(terrain.limits, mean_separation_m=(0.0, 1e6))
    world = msgspec.structs.replace(terrain.world, peaks=(), threats=())
    north, south = (200.0, 600.0, 100.0), (600.0, 200.0, 100.0)

    def flown_from(pads_m: tuple[Point3, ...]) -> dict[Limit, Violation]:
        mission = msgspec.structs.replace(
            terrain,
            world=world,
            limits=near,
            vehicles=tuple(
                msgspec.structs.replace(vehicle, pad_m=pad_m)
                for vehicle, pad_m in zip(terrain.vehicles[:2], pads_m, strict=True)
            ),
            targets=tuple(
                msgspec.structs.replace(target, position_m=place)
                for target, place in zip(terrain.targets[:2], (north, south), strict=True)
            ),
        )
        return found(mission, flown(mission, [straight((0, 0, 0), north), straight((0, 0, 0), south)]))

    pads_m = ((3.0, 6.0, 0.0), (6.0, 3.0, 0.0))
    assert flown_from(pads_m) == {}
    breach = flown_from(pads_m[::-1])[Limit.SEPARATION]
    assert (breach.vehicle, breach.required) == ("alpha", pytest.approx(0.4))
    assert breach.where == "on the way from its pad to its curve, to bravo"


def test_samples_that_hide_something_between_them_are_refused():
    mission, _ = straight_room()
    curves = flown(mission, [straight((1, 6, 1.5), (19, 6, 1.5)), straight((1, 8, 1.5), (19, 8, 1.5))], count=100)
    with pytest.raises(ValueError, match=r"samples of v1's curve: 0.182 m apart, expected at most 0.05 m"):
        feasibility.violations(mission, curves)
