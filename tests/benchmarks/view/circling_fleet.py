"""A fleet without a mission that flies circles: it never stands still, and its trails never end."""

import numpy as np

from gcs.dialect import Mode
from gcs.planner.plan import VehiclePlan
from missions.mission import load_mission
from missions.mission_items import Track
from missions.tunnel import CompanionState
from tests.browser.scripted_desk import ScriptedDesk

SPACING_M, RADIUS_M, SPEED_M_S = 12.0, 4.0, 3.0
DRIFT_M_S = 0.15
"""The circles move on, so that trails do not cover themselves."""


def circling(count: int) -> ScriptedDesk:
    """So many vehicles, with companions that report what they fly."""
    scripted = ScriptedDesk(None, watched=count)
    angles = np.linspace(0.0, 1200.0 * np.pi, 60_000)
    times_s = angles * RADIUS_M / SPEED_M_S
    for index, vehicle in enumerate(scripted.vehicles):
        centre_m = np.array([SPACING_M * (index % 10), SPACING_M * (index // 10), 5.0])
        turn = np.stack((np.cos(angles), np.sin(angles), 0.2 * np.sin(3 * angles)), axis=1)
        curve_m = centre_m + RADIUS_M * turn + np.outer(times_s, [DRIFT_M_S, 0.0, 0.0])
        track, target = Track(curve_m[-1:], np.array([SPEED_M_S])), load_mission("field").targets[0]
        vehicle.plan = VehiclePlan("", vehicle.sysid, (target,), curve_m, times_s, track, 1.0)
        vehicle.mode, vehicle.armed, vehicle.companion = Mode.OFFBOARD, True, CompanionState.FLYING
    return scripted


def flown_before(scripted: ScriptedDesk, seconds: float, interval_s: float) -> None:
    """Let a time pass of which only the trails are left."""
    assert scripted.desk.trails is not None
    for vehicle in scripted.vehicles:
        vehicle.fly_on(interval_s)
    scripted.say()
    scripted.sample()
    for vehicle in scripted.vehicles:
        trail = scripted.desk.trails.by_sysid[vehicle.sysid]
        for _ in range(round(seconds / interval_s)):
            vehicle.fly_on(interval_s)
            trail.append(vehicle.clock_s, vehicle.position_m, vehicle.velocity_m_s)
