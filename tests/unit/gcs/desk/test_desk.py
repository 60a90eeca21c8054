"""The desk's one door: what can be asked for when, and what comes of it."""

import asyncio

import pytest

from gcs.desk import Desk, Details, Intent
from gcs.desk.desk import MOST_QUOTED
from gcs.desk.intents import NewMission
from gcs.desk.orders import OrderState
from gcs.dialect import Mode
from gcs.errors import CommandRefused
from gcs.fleet.status_texts import StatusText
from gcs.fleet.vehicle_state import LandedState, VehicleState
from gcs.flight.monitor import Phase
from gcs.planner.plan import FleetPlan
from missions.faults import LinkFault, SimulatorFault
from missions.mission import Mission, load_mission
from tests.browser.scripted_desk import ScriptedDesk
from tests.browser.scripted_plan import scripted_plan
from tests.unit.gcs.view.desks import make_desk

BOTH = [1, 2]


async def settle(desk: Desk) -> None:
    """Let what was asked for come to its end."""
    while desk._tasks:
        await asyncio.gather(*desk._tasks, return_exceptions=True)


def put(desk: Desk, phase: Phase, *, armed: bool = True) -> None:
    assert desk.flight is not None
    for sysid, part in desk.flight.vehicles.items():
        part.monitor.phase = phase
        state = desk.vehicles[sysid]
        state.armed, state.landed = armed, LandedState.IN_AIR if phase.in_flight else LandedState.ON_GROUND


@pytest.mark.parametrize(
    ("phase", "possible"),
    [
        (Phase.WAITING, {Intent.UPLOAD}),
        (Phase.HOVERING, {Intent.START, Intent.HOLD, Intent.RTL, Intent.LAND, Intent.GO_TO, Intent.KILL}),
        (Phase.FLYING, {Intent.HOLD, Intent.RTL, Intent.LAND, Intent.GO_TO, Intent.KILL}),
        (Phase.INTERRUPTED, {Intent.RESUME, Intent.HOLD, Intent.RTL, Intent.LAND, Intent.GO_TO, Intent.KILL}),
        (Phase.DONE, set()),
    ],
)
async def test_each_phase_has_its_orders_and_the_others_say_why_not(phase: Phase, possible: set[Intent]):
    desk = await make_desk()
    put(desk, phase, armed=phase.in_flight)
    for state in desk.vehicles.values():
        state.mode = Mode.OFFBOARD
    orders = [intent for intent in Intent if intent.concerns_vehicles and intent is not Intent.LINK]
    assert {intent for intent in orders if desk.why_not(intent, BOTH) is None} == possible


async def test_a_flood_of_texts_is_held_back_and_an_emergency_is_not():
    desk = await make_desk()
    for sysid in range(1, 250):
        state = desk.vehicles.setdefault(sysid, VehicleState(sysid))
        state.texts.extend(StatusText(1.0, 6, f"chatter {number}") for number in range(20))
    desk.vehicles[200].texts.append(StatusText(2.0, 1, "Motor failure"))
    desk.collect_texts()
    said = [event for event in desk.events.events if event.kind == "said"]
    assert len(said) == MOST_QUOTED + 1
    assert "Motor failure" in {event.text for event in said}


async def test_who_holds_already_can_be_told_to_hold_only_while_its_companion_is_about_to_take_over():
    desk = await make_desk()
    put(desk, Phase.FLYING)
    for state in desk.vehicles.values():
        state.mode = Mode.HOLD
    assert desk.why_not(Intent.HOLD, BOTH) is None
    put(desk, Phase.HOVERING)
    assert desk.why_not(Intent.HOLD, BOTH) == "already in hold"


async def test_a_prepared_vehicle_can_be_armed_once_nothing_speaks_against_it():
    desk = await make_desk()
    put(desk, Phase.PREPARED, armed=False)
    assert desk.why_not(Intent.ARM, BOTH) == "no position"
    for state in desk.vehicles.values():
        state.place_s, state.ready_to_arm = desk.station.now_s, True
    assert desk.why_not(Intent.ARM, BOTH) is None
    assert desk.why_not(Intent.TAKE_OFF, BOTH) is None  # it arms first
    put(desk, Phase.PREPARED, armed=True)
    assert desk.why_not(Intent.ARM, BOTH) == "already armed"
    assert desk.why_not(Intent.TAKE_OFF, BOTH) is None


async def test_an_order_is_pending_until_the_vehicle_has_answered():
    scripted = ScriptedDesk("indoor")
    await scripted.begin(at_s=[2.0, 2.0])
    desk = scripted.desk
    assert desk.request(Intent.HOLD, [1]) is None
    (order,) = desk.orders.orders
    assert (order.who, order.state) == ("alpha", OrderState.PENDING)
    await asyncio.sleep(0.05)
    assert order.state is OrderState.ACCEPTED
    await desk.close()


async def test_what_was_refused_says_so_and_by_whom():
    desk = await make_desk()
    put(desk, Phase.FLYING)
    refusing = CommandRefused("vehicle 1: land: DENIED")

    async def refuse(*_: object) -> None:
        raise refusing

    desk.station.run = refuse  # type: ignore[method-assign]
    desk.request(Intent.LAND, [1])
    await asyncio.sleep(0.05)
    (order,) = desk.orders.orders
    assert (order.state, order.reason) == (OrderState.REFUSED, "vehicle 1: land: DENIED")
    await desk.close()


async def test_who_looks_on_commands_nothing():
    desk = await make_desk()
    desk.seat.arrive("a", "browser 1")
    desk.seat.arrive("b", "browser 2")
    assert desk.request(Intent.PLAN, by="b") == "browser 1 is in command"
    assert desk.running is None
    refused = desk.events.events[-1]
    assert (refused.kind, refused.data["by"]) == ("refused", "browser 2")


async def test_a_plan_that_is_made_can_be_cancelled():
    desk = await make_desk(planned=False)
    began, cancelled = asyncio.Event(), asyncio.Event()

    async def plan(mission: Mission, *_: object) -> FleetPlan:
        began.set()
        try:
            await asyncio.Event().wait()
        except asyncio.CancelledError:
            cancelled.set()
            raise
        return scripted_plan(mission)

    assert desk.flight is not None
    desk.flight.planner = plan
    assert desk.why_not(Intent.CANCEL) == "nothing is under way"
    desk.request(Intent.PLAN)
    await began.wait()
    assert desk.why_not(Intent.PLAN) == "Plan is under way"
    assert desk.why_not(Intent.UPLOAD, BOTH) == "Plan is under way"
    desk.request(Intent.CANCEL)
    await settle(desk)
    assert cancelled.is_set()
    assert desk.orders.orders[-1].state is OrderState.CANCELLED
    assert desk.running is None


class Choice:
    algorithm = "ecpso"
    algorithms = ("ecpso", "pso")


async def test_algorithms_are_compared_and_the_best_plan_is_taken():
    desk = await make_desk(planned=False)
    desk.planner = choice = Choice()
    assert desk.flight is not None

    async def plan(mission: Mission, *_: object) -> FleetPlan:
        worth = {"ecpso": 6.4, "pso": 9.9}[choice.algorithm]
        return FleetPlan(**(vars(scripted_plan(mission)) | {"algorithm": choice.algorithm, "objective": worth}))

    desk.flight.planner = plan
    desk.request(Intent.ALGORITHM, details=Details(algorithm="pso"))
    await settle(desk)
    desk.request(Intent.COMPARE)
    await settle(desk)
    assert list(desk.flight.candidates) == ["ecpso", "pso"]
    assert desk.flight.plan is not None
    assert (desk.flight.plan.algorithm, choice.algorithm) == ("ecpso", "pso")


async def test_a_mission_is_opened_while_nothing_flies():
    desk = await make_desk()
    assert desk.why_not(Intent.LOAD) == "this station flies what it was started with"
    opened: list[str] = []

    async def opener(new: NewMission | None, mode: object) -> None:
        assert new is not None
        opened.append(new.source)

    desk.opener = opener
    request = Details(new=NewMission(load_mission("field"), "field"))
    desk.request(Intent.LOAD, details=request)
    await settle(desk)
    assert opened == ["field"]
    put(desk, Phase.FLYING)
    assert desk.request(Intent.LOAD, details=request) == "vehicles are in flight"


async def test_vehicles_go_where_they_can_and_are_told_why_not_where_they_cannot():
    scripted = ScriptedDesk("indoor")
    await scripted.begin(at_s=[2.0, 2.0])
    desk = scripted.desk
    desk.request(Intent.GO_TO, [1], Details(place_m=(7.0, 7.0, 1.5)))
    await asyncio.sleep(0.05)
    assert desk.orders.orders[-1].state is OrderState.REFUSED
    here_m = desk.position_m(1)
    assert here_m is not None
    desk.request(Intent.GO_TO, [1], Details(place_m=(float(here_m[0]), float(here_m[1]) - 0.5, 1.5)))
    await asyncio.sleep(0.05)
    assert desk.orders.orders[-1].state is OrderState.ACCEPTED
    await desk.close()


async def test_links_are_disturbed_in_the_simulator_alone():
    desk = await make_desk()
    assert desk.why_not(Intent.LINK, [1]) == "no simulator: these links are real"
    ordered: list[tuple[SimulatorFault, int]] = []

    class Simulator:
        async def order(self, fault: SimulatorFault, sysid: int) -> None:
            ordered.append((fault, sysid))

    desk.simulator = Simulator()
    desk.request(Intent.LINK, BOTH, Details(fault=LinkFault(loss=0.3)))
    await settle(desk)
    assert ordered == [(LinkFault(loss=0.3), 1), (LinkFault(loss=0.3), 2)]


async def test_a_flight_that_is_about_to_begin_waits_for_its_operator():
    desk = await make_desk()
    assert desk.why_not(Intent.WAIT) == "nothing is about to begin by itself"
    desk.begins_s = desk.station.now_s + 5.0
    desk.request(Intent.WAIT)
    assert desk.taken_over.is_set()
