"""Carries out what was asked of single vehicles: those of the flight by its steps, others by plain commands."""

from typing import TYPE_CHECKING

import numpy as np

from gcs.desk.intents import Details, Intent
from gcs.desk.reposition import why_not_there
from gcs.desk.rules import MODES
from gcs.dialect import AUTOPILOT
from gcs.errors import UsageError
from gcs.flight import actions
from gcs.flight.sequence import FleetFlight
from gcs.flight.vehicle_flight import VehicleFlight
from gcs.microservices.command_client import Command, CommandClient

if TYPE_CHECKING:
    from gcs.desk.desk import Desk


async def carry_out(desk: "Desk", intent: Intent, sysid: int, details: Details) -> None:
    """Do with one vehicle what was asked for.

    Raises:
        GcsError: it was refused, or went wrong.
    """
    if intent is Intent.LINK:
        await _disturb_link(desk, sysid, details)
        return
    if intent is Intent.GO_TO:
        check_place(desk, sysid, details)
    part = desk.part(sysid)
    if desk.flight is None or part is None:
        command = _plain_command(desk, intent, details)
        desk.events.add("command", command.name, desk.name(sysid))
        await desk.station.run(CommandClient(command, (sysid, AUTOPILOT)))
        return
    await _step(desk.flight, intent, part, details)


def check_place(desk: "Desk", sysid: int, details: Details) -> None:
    """See that a vehicle can be sent to the place in `details`.

    Raises:
        UsageError: it cannot; says why.
    """
    here_m = desk.position_m(sysid)
    if details.place_m is None or here_m is None:
        raise UsageError("no place was given" if details.place_m is None else "nobody knows where it is")
    if desk.mission is None:
        return
    others = [desk.position_m(other) for other, state in desk.vehicles.items() if other != sysid and state.airborne]
    others_m = np.array([place_m for place_m in others if place_m is not None]).reshape(-1, 3)
    why_not = why_not_there(desk.mission, here_m, np.array(details.place_m), others_m)
    if why_not is not None:
        raise UsageError(why_not)


async def _step(flight: FleetFlight, intent: Intent, part: VehicleFlight, details: Details) -> None:
    orders = flight.orders
    match intent:
        case Intent.UPLOAD:
            await flight.connect_one(part)
            await flight.prepare([part])
        case Intent.TAKE_OFF:
            await flight.take_off(part)
        case Intent.GO_TO:
            assert details.place_m is not None
            await orders.go_to(part, np.array(details.place_m))
        case Intent.SPEED:
            assert details.speed_m_s is not None
            await orders.change_speed(part, details.speed_m_s)
        case _:
            simple = {
                Intent.ARM: orders.arm,
                Intent.START: orders.start,
                Intent.HOLD: orders.hold,
                Intent.RESUME: orders.start,
                Intent.RTL: orders.return_home,
                Intent.LAND: orders.land,
                Intent.KILL: orders.kill,
            }
            await simple[intent](part)


def _plain_command(desk: "Desk", intent: Intent, details: Details) -> Command:
    """For a vehicle that has no part in a flight of ours."""
    if intent is Intent.KILL:
        return actions.kill()
    if intent is Intent.SPEED and details.speed_m_s is not None:
        return actions.change_speed(details.speed_m_s)
    if intent is Intent.GO_TO and details.place_m is not None and desk.trails is not None:
        return actions.go_to(desk.trails.frame.geodetic(np.array(details.place_m)))
    if intent in MODES:
        return actions.set_mode(MODES[intent])
    raise UsageError(f"{intent.value} needs a mission")


async def _disturb_link(desk: "Desk", sysid: int, details: Details) -> None:
    if desk.simulator is None or details.fault is None:
        raise UsageError("there is no simulator")
    await desk.simulator.order(details.fault, sysid)
