"""Whether what an operator asks for can be done now, and if not, why: phrases for the page."""

from typing import TYPE_CHECKING

from gcs.desk.intents import Intent
from gcs.dialect import Mode
from gcs.fleet.vehicle_state import VehicleState
from gcs.flight import preflight
from gcs.flight.monitor import Phase
from gcs.flight.sequence import FleetFlight
from gcs.flight.vehicle_flight import VehicleFlight
from gcs.settings import PlanningMode

if TYPE_CHECKING:
    from gcs.desk.desk import Desk

FLOWN = "this mission has been flown"
IN_FLIGHT = "vehicles are in flight"

MODES = {Intent.HOLD: Mode.HOLD, Intent.RTL: Mode.RTL, Intent.LAND: Mode.LAND}
"""What these intents command."""

_OF_A_MISSION = {Intent.UPLOAD, Intent.ARM, Intent.TAKE_OFF, Intent.START, Intent.RESUME}
_NEEDS_THE_PLANNER = {Intent.PLAN, Intent.COMPARE, Intent.ALGORITHM}
_AUTO_MODES = {Mode.HOLD, Mode.MISSION, Mode.RTL, Mode.TAKEOFF}


def why_not_flight(desk: "Desk", intent: Intent) -> str | None:
    """Why an intent that concerns the whole flight cannot be done now; None if it can."""
    flight = desk.flight
    if intent in {Intent.LOAD, Intent.MODE} and desk.opener is None:
        return "this station flies what it was started with"
    if flight is None:
        return None if intent is Intent.LOAD and desk.running is None else "no mission is loaded"
    if intent is Intent.WAIT:
        return None if desk.begins_s is not None else "nothing is about to begin by itself"
    if intent is Intent.CANCEL:
        return _why_not_cancel(desk, flight)
    if intent is Intent.REPLAN:
        return _why_not_replan(flight)
    if desk.running is not None:
        return f"{desk.running.value} is under way"
    if desk.orders.pending(intent, None):
        return f"{intent.value} is under way"
    if flight.in_flight:
        return IN_FLIGHT
    if intent is Intent.LOAD:
        return None
    if any(part.monitor.phase is Phase.DONE for part in flight.vehicles.values()):
        return FLOWN
    if intent in _NEEDS_THE_PLANNER - {Intent.PLAN} and desk.planner is None:
        return "there is one planner alone"
    return None


def why_not_vehicle(desk: "Desk", intent: Intent, sysid: int) -> str | None:
    """Why an intent cannot be done with one vehicle now; None if it can."""
    state = desk.vehicles.get(sysid)
    if intent is Intent.LINK:
        return None if desk.simulator is not None else "no simulator: these links are real"
    if intent in _OF_A_MISSION and (why := _why_not_of_mission(desk, intent, sysid)) is not None:
        return why
    if state is None or not state.online(desk.station.now_s):
        return "not heard"
    if desk.orders.pending(intent, sysid):
        return f"{intent.value} is under way"
    part = desk.part(sysid)
    if intent in {Intent.UPLOAD, Intent.ARM, Intent.TAKE_OFF, Intent.START}:
        assert part is not None
        return _why_not_begin(desk, intent, state, part)
    if not state.armed:
        return "not in flight"
    return _why_not_in_flight(intent, state, part)


def _why_not_cancel(desk: "Desk", flight: FleetFlight) -> str | None:
    if desk.running is None:
        return "nothing is under way"
    return IN_FLIGHT if flight.in_flight else None


def _why_not_replan(flight: FleetFlight) -> str | None:
    if not any(part.monitor.phase is Phase.FLYING for part in flight.in_flight):
        return "no vehicle flies its mission; on the ground, Plan makes a new plan"
    if flight.mode is not PlanningMode.END_CLOUD:
        return f"in {flight.mode.value} mode the plan is not changed in flight"
    return None


def _why_not_of_mission(desk: "Desk", intent: Intent, sysid: int) -> str | None:
    """What holds for everything that needs the vehicle to have a part in the mission."""
    flight, part = desk.flight, desk.part(sysid)
    if flight is None:
        return "no mission is loaded" if intent is not Intent.RESUME else "nothing was interrupted"
    if intent is Intent.RESUME:
        return None if part is not None and part.monitor.phase.in_flight else "not in flight"
    if desk.running is not None:
        return f"{desk.running.value} is under way"
    if flight.plan is None:
        return "there is no plan yet"
    return None if part is not None else "it has no target in this plan"


def _why_not_begin(desk: "Desk", intent: Intent, state: VehicleState, part: VehicleFlight) -> str | None:
    phase = part.monitor.phase
    if phase is Phase.DONE:
        return FLOWN
    if intent is Intent.START:
        return None if phase is Phase.HOVERING else "not hovering" if not phase.in_flight else f"it is {phase.value}"
    if phase.in_flight:
        return "in flight"
    if intent is Intent.UPLOAD:
        return None
    if phase is not Phase.PREPARED:
        return "nothing is uploaded yet"
    if intent is Intent.TAKE_OFF and state.armed:
        return None
    assert desk.mission is not None
    return next(preflight.problems(state, part.vehicle, desk.mission, desk.station.now_s), None)


def _why_not_in_flight(intent: Intent, state: VehicleState, part: VehicleFlight | None) -> str | None:
    if intent is Intent.RESUME:
        interrupted = part is not None and part.monitor.phase is Phase.INTERRUPTED
        return None if interrupted else "nothing was interrupted"
    if intent is Intent.GO_TO:
        return None if state.airborne else "not in the air"
    if intent is Intent.SPEED and state.mode not in _AUTO_MODES:
        return "its companion keeps the mission's speeds" if state.mode is Mode.OFFBOARD else "not in an auto mode"
    if intent is Intent.HOLD and _about_to_fly(part):
        return None
    return f"already in {state.mode.name.lower()}" if MODES.get(intent) is state.mode else None


def _about_to_fly(part: VehicleFlight | None) -> bool:
    """Its mission is started; it may hold still, but only until its companion has taken over."""
    return part is not None and part.monitor.phase is Phase.FLYING and not part.monitor.paused_by_operator
