"""Desks for tests of the page's pure parts: a real flight whose vehicles are set by hand."""

import time

import numpy as np

from gcs.desk import Desk
from gcs.flight.events import EventLog
from gcs.flight.sequence import FleetFlight
from gcs.flight.trails import Trails
from gcs.planner.plan import FleetPlan
from gcs.settings import PlanningMode
from gcs.station import Station
from missions.mission import Mission, load_mission
from tests.browser.scripted_plan import scripted_plan
from tests.unit.gcs import messages as mav


async def make_desk(mission: str | None = "indoor", *, planned: bool = True, heard: tuple[int, ...] = (1, 2)) -> Desk:
    """A desk at which these vehicles were heard, standing on the mission's first pads."""

    async def planner(loaded: Mission, *_: object) -> FleetPlan:
        return scripted_plan(loaded)

    station, events = Station(), EventLog(time.monotonic)
    if mission is None:
        desk = Desk(station, events)
    else:
        loaded = load_mission(mission)
        flight = FleetFlight(station, loaded, PlanningMode.END_CLOUD, planner, events, unattended=False)
        desk = Desk(station, events, flight, Trails(loaded.frame))
        if planned:
            await flight.make_plan()
    for sysid in heard:
        station.fleet.fold(mav.heartbeat(sysid=sysid), station.now_s)
        desk.vehicles[sysid].telemetry_s = station.now_s
        if desk.mission is not None:
            pad_m = np.array(desk.mission.vehicles[sysid - 1].pad_m)
            desk.vehicles[sysid].place = desk.mission.frame.geodetic(pad_m)
    return desk
