"""Whole flights by single orders at the desk, as an operator gives them: in process, on the virtual clock."""

import asyncio
from collections.abc import Awaitable, Callable

import numpy as np

from gcs.desk import Desk, Details, Intent
from gcs.desk.intents import NO_DETAILS
from gcs.desk.orders import Order, OrderState
from gcs.flight.sequence import FleetFlight
from gcs.flight.trails import Trails
from gcs.settings import PlanningMode
from missions.mission import load_mission
from tests.simulation.whole_system import WholeSystem

INDOOR = load_mission("indoor")
BOTH = [1, 2]


class Operator:
    """Somebody at the desk of a flight."""

    def __init__(self, flight: FleetFlight) -> None:
        self.desk = Desk(flight.station, flight.events, flight, Trails(flight.mission.frame))

    async def order(self, intent: Intent, sysids: list[int] = BOTH, details: Details = NO_DETAILS) -> list[Order]:
        """Give an order as soon as it can be given, and wait for what comes of it."""
        await self.until(lambda: self.desk.why_not(intent, sysids) is None)
        before = len(self.desk.orders.orders)
        assert self.desk.request(intent, sysids, details) is None
        given = list(self.desk.orders.orders)[before:]
        await self.until(lambda: all(order.state is not OrderState.PENDING for order in given))
        return given

    async def until(self, condition: Callable[[], bool], timeout_s: float = 120.0) -> None:
        await self.desk.station.wait_until(condition, timeout_s, "waited in vain")


async def begin(operator: Operator) -> None:
    assert operator.desk.flight is not None
    await operator.desk.flight.connect()
    for intent in (Intent.PLAN, Intent.UPLOAD, Intent.ARM, Intent.TAKE_OFF, Intent.START):
        orders = await operator.order(intent)
        assert [order.state for order in orders] == [OrderState.ACCEPTED] * len(orders), orders


def fly(work: Callable[[Operator], Awaitable[None]], mode: PlanningMode = PlanningMode.CLOUD) -> WholeSystem:
    async def operate(flight: FleetFlight) -> None:
        flight.unattended = False
        operator = Operator(flight)
        await begin(operator)
        await work(operator)
        await operator.until(lambda: flight.finished)
        await operator.desk.close()

    system = WholeSystem(INDOOR, mode, operate=operate)
    system.fly()
    return system


async def nothing_more(operator: Operator) -> None: ...


def test_step_by_step_both_drones_reach_their_targets():
    system = fly(nothing_more)
    assert system.error is None
    assert system.flight.success


def test_an_autopilot_that_is_told_to_start_again_does_not_turn_back():
    """Be it a late copy on a slow link or a resumption: on its way back, soak seed 7018 hit the crate."""

    async def start_again(operator: Operator) -> None:
        flight = operator.desk.flight
        assert flight is not None
        await asyncio.sleep(4.0)
        await flight.orders.start(flight.vehicles[1])
        await operator.order(Intent.HOLD, [2])
        await asyncio.sleep(2.0)
        await operator.order(Intent.RESUME, [2])

    system = fly(start_again)
    assert system.flight.success
    for flown in system.flown().values():
        east_m = flown.positions_m[:, 0]
        assert (np.maximum.accumulate(east_m) - east_m).max() < 1.5


def test_held_and_resumed_with_their_companions_they_arrive_as_well():
    async def hold_and_resume(operator: Operator) -> None:
        await asyncio.sleep(4.0)
        (held, _) = await operator.order(Intent.HOLD)
        assert held.state is OrderState.ACCEPTED
        await asyncio.sleep(2.0)
        await operator.order(Intent.RESUME)

    assert fly(hold_and_resume, PlanningMode.END_CLOUD).flight.success


def test_a_hold_that_comes_before_the_companions_have_taken_over_stops_them_all_the_same():
    crept_m: list[float] = []

    async def hold_at_once(operator: Operator) -> None:
        begun_m = [operator.desk.position_m(sysid) for sysid in BOTH]
        assert operator.desk.why_not(Intent.HOLD, BOTH) is None
        await operator.order(Intent.HOLD)
        await operator.until(lambda: operator.desk.why_not(Intent.RESUME, BOTH) is None, 15.0)
        held_m = [operator.desk.position_m(sysid) for sysid in BOTH]
        crept_m.extend(float(np.linalg.norm(held - begun)) for held, begun in zip(held_m, begun_m, strict=True))
        await operator.order(Intent.RESUME)

    assert fly(hold_at_once, PlanningMode.END_CLOUD).flight.success
    assert max(crept_m) < 2.0


def test_one_is_sent_to_a_place_at_its_height_and_landed_there_while_the_other_flies_on():
    place_m = (3.0, 4.0, 2.0)
    reached: list[float] = []

    async def send(operator: Operator) -> None:
        await asyncio.sleep(1.0)
        (sent,) = await operator.order(Intent.GO_TO, [1], Details(place_m=place_m))
        assert sent.state is OrderState.ACCEPTED, sent.reason
        await asyncio.sleep(12.0)
        here_m = operator.desk.position_m(1)
        assert here_m is not None
        reached.append(float(np.linalg.norm(here_m - place_m)))
        await operator.order(Intent.LAND, [1])

    flight = fly(send).flight
    assert reached[0] < 0.4
    assert (flight.vehicles[1].monitor.reached, flight.vehicles[2].monitor.reached) == (False, True)
    assert flight.vehicles[1].monitor.reason == "paused by the operator"


def test_motors_that_are_killed_stop():
    async def kill(operator: Operator) -> None:
        await asyncio.sleep(3.0)
        await operator.order(Intent.KILL, [2])

    flight = fly(kill).flight
    assert not flight.vehicles[2].monitor.reached
    assert flight.vehicles[2].monitor.reason == "motors stopped by the operator"
    assert flight.vehicles[1].monitor.reached
