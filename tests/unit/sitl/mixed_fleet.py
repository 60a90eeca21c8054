"""A short flight of five vehicles under five kinds of guidance, whose end is written to a file.

Run as a program with NUMBA_DISABLE_JIT=1 it is the reference for the compiled code: the same source, interpreted.
"""

import sys

import numpy as np

from missions.mission import Positioning
from missions.world import Bounds, Box, Cylinder, Mover, Peak, World
from sitl.dynamics.airframe import X500_LIKE
from sitl.dynamics.state import Guidance, TakeoffStage
from sitl.fleet import TICK_S, Fleet
from tests.unit.sitl.flown import field
from tests.unit.sitl.test_control import default_gains

WORLD = World(
    bounds=Bounds(east_m=(-100, 100), north_m=(-100, 100), up_m=(0, 50)),
    boxes=(Box(name="wall", centre_m=(12.0, 1.5, 5.0), half_m=(0.5, 0.5, 5.0)),),
    cylinders=(Cylinder(name="pole", centre_m=(50, 50), radius_m=1.0, top_m=5.0),),
    peaks=(Peak(name="hill", centre_m=(30.0, 30.0), radius_m=20.0),),
    movers=(Mover(name="ball", from_m=(50, 0, 5), to_m=(40, 0, 5), radius_m=0.5, speed_m_s=1.0),),
)
TICKS = 40


def flown_fleet() -> Fleet:
    """Five vehicles in the air, each flown otherwise; the last one flies into a wall."""
    mission = field(5, world=WORLD, positioning=Positioning(), wind_enu_m_s=(2.0, -1.0, 0.0), gust_std_m_s=1.0)
    fleet = Fleet(mission, X500_LIKE, np.random.default_rng(7))
    fleet.gains[:] = default_gains()[0]
    v = fleet.vehicles
    v["position_m"][:, 2] = [-5.0, -0.3, -4.0, -6.0, -5.0]
    v["velocity_m_s"][:, 0] = [1.0, 0.0, 0.5, 0.0, 3.0]
    for flag in ("landed", "maybe_landed", "ground_contact", "grounded"):
        v[flag] = 0
    v["takeoff_stage"] = [
        TakeoffStage.FLIGHT,
        TakeoffStage.FLIGHT,
        TakeoffStage.RAMPUP,
        TakeoffStage.FLIGHT,
        TakeoffStage.FLIGHT,
    ]
    v["guidance"] = [Guidance.WAYPOINT, Guidance.LAND, Guidance.SETPOINT, Guidance.ATTITUDE, Guidance.RATES]
    v["rotor"], v["tilt_limit_rad"], v["setpoint_thrust"] = 0.7, 0.6, 0.6
    v["smooth_position_m"], v["smooth_velocity_m_s"] = v["position_m"], v["velocity_m_s"]
    v["target_m"] = [[20.0, 5.0, -8.0]] * 5
    v["next_m"], v["previous_m"] = [[25.0, 15.0, -6.0]] * 5, [[0.0, 0.0, -5.0]] * 5
    v["target_yaw_rad"], v["yaw_before_rad"], v["cruise_m_s"], v["acceptance_m"] = np.nan, 0.0, 5.0, 2.0
    v["setpoint_position_m"] = np.nan
    v["setpoint_velocity_m_s"] = [[1.0, 0.5, -0.4]] * 5
    v["setpoint_acceleration_m_s2"] = np.nan
    v["setpoint_attitude"][3] = [0.99, 0.1, -0.08, 0.05]
    v["setpoint_rates_rad_s"][4] = [0.2, -0.1, 0.3]
    for tick in range(TICKS):
        fleet.advance(tick * TICK_S)
    return fleet


def end_state() -> np.ndarray:
    """Every number of every vehicle at the end of the flight, then what each autopilot sees."""
    fleet = flown_fleet()
    state = [np.ravel(fleet.vehicles[name]).astype(float) for name in fleet.vehicles.dtype.names]
    return np.concatenate([*state, np.ravel(np.array(fleet.views()))])


if __name__ == "__main__":
    np.save(sys.argv[1], end_state())
