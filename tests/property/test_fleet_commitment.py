"""Vehicles that fly where they like, and keep apart by what they tell each other alone: no cloud, no sensor."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.fleet.conflict import first_conflict_s
from companion.fleet.neighbour import Neighbour
from companion.planner.planner import Plan
from companion.traffic import Traffic
from missions.trajectory import Trajectory, at_rest
from missions.tunnel import TrajectoryKind
from tests.unit.companion.fleet.talk import ROOM, Air, line

LIMITS = ROOM.limits
ROUNDING_M = 0.05
"""Centimetres on the wire, 20 ms ticks, and the beginning of a plan that is led in."""


class Checks:
    """The planner's check, as far as vehicles meet vehicles."""

    def is_clear(self, trajectory: Trajectory, now_s: float, neighbours: tuple[Neighbour, ...]) -> bool:
        return first_conflict_s(trajectory, neighbours, LIMITS, now_s)[1] is None


@dataclass(frozen=True)
class Wish:
    """A plan as a planner would hand it over."""

    trajectory: Trajectory


class Wanderers:
    """Vehicles that ask for straight lines to random places all the time, without looking whether they are free.

    Args:
        air: between them.
        seed: where they want to go, and when.
    """

    def __init__(self, air: Air, seed: int) -> None:
        self._air = air
        self._rng = np.random.default_rng(seed)
        self._traffic = [Traffic(exchange, Checks(), LIMITS) for exchange in air.exchanges]  # type: ignore[arg-type]
        self.flown = [at_rest(place_m, air.time_s(number)) for number, place_m in enumerate(air.places)]
        for number, (traffic, path) in enumerate(zip(self._traffic, self.flown, strict=True)):
            traffic.fly(TrajectoryKind.COMMITTED, path, 1, air.time_s(number))
            air.paths[number] = path
        self.asked = self.granted = 0

    def run(self, duration_s: float) -> float:
        """Let time pass; the least distance between any two vehicles."""
        least_m = np.inf
        for _ in range(round(duration_s / 0.02)):
            self._air.tick()
            for number, traffic in enumerate(self._traffic):
                self._act(number, traffic)
            least_m = min(least_m, self._least_m())
        return least_m

    def _act(self, number: int, traffic: Traffic) -> None:
        now_s = self._air.time_s(number)
        decision = traffic.decision(now_s)
        if decision is not None and decision.clear:
            assert decision.plan.trajectory is not None
            self.granted += 1
            self.flown[number] = self._air.paths[number] = decision.plan.trajectory
        rests = now_s > self.flown[number].end_s
        if rests and not traffic.is_waiting and self._rng.random() < 0.05:
            self._ask(number, traffic, now_s)

    def _ask(self, number: int, traffic: Traffic, now_s: float) -> None:
        self.asked += 1
        wait_s = traffic.wait_s(now_s)
        place_m, goal_m = self.flown[number].end_m, self._rng.uniform((1, 1, 1.5), (12, 12, 1.5))
        lasts_s = max(float(np.linalg.norm(goal_m - place_m)), 1.0)
        wish: Plan = Wish(line(tuple(place_m), tuple(goal_m), now_s + wait_s, lasts_s))  # type: ignore[assignment]
        assert wish.trajectory is not None
        traffic.offer(wish, wish.trajectory, 1, wait_s, now_s)

    def _least_m(self) -> float:
        places_m = [path.at(self._air.time_s(number)).position_m for number, path in enumerate(self.flown)]
        apart_m = np.linalg.norm(np.array(places_m)[:, None] - np.array(places_m), axis=2)
        return float(apart_m[~np.eye(len(places_m), dtype=bool)].min())


@settings(max_examples=12)
@given(
    n=st.integers(2, 5),
    delay_s=st.floats(0.0, 0.4),
    duplicates=st.sampled_from([0.0, 0.5]),
    errors_s=st.lists(st.floats(-0.01, 0.01), min_size=5, max_size=5),
    seed=st.integers(0, 1000),
)
def test_whatever_the_link_delays_two_vehicles_never_fly_plans_that_meet(
    n: int, delay_s: float, duplicates: float, errors_s: list[float], seed: int
):
    air = Air(n, delay_s=delay_s, jitter_s=0.02, duplicates=duplicates, clock_errors_s=tuple(errors_s[:n]), seed=seed)
    wanderers = Wanderers(air, seed)
    air.run(2.0)
    assert wanderers.run(15.0) > LIMITS.separation_m - ROUNDING_M


def test_they_do_fly_and_are_refused_some_of_what_they_ask_for():
    air = Air(5, delay_s=0.1)
    wanderers = Wanderers(air, seed=1)
    air.run(2.0)
    wanderers.run(30.0)
    assert 10 < wanderers.granted < wanderers.asked


@pytest.mark.parametrize("seed", range(3))
def test_a_fifth_of_all_words_may_be_lost(seed: int):
    """Each is told several times: no plan of these flights is flown that was not heard of in time."""
    air = Air(4, delay_s=0.05, loss=0.2, seed=seed)
    wanderers = Wanderers(air, seed)
    air.run(2.0)
    assert wanderers.run(20.0) > LIMITS.separation_m - ROUNDING_M


def test_without_the_wait_they_do_collide():
    """That the two steps are what keeps them apart: the same flights, each plan flown as soon as it is announced."""
    air = Air(5, delay_s=0.3)
    for exchange in air.exchanges:
        exchange.wait_s = lambda now_s: 0.02  # type: ignore[method-assign]
    wanderers = Wanderers(air, seed=1)
    air.run(2.0)
    assert wanderers.run(30.0) < LIMITS.separation_m - ROUNDING_M
