"""A fleet's physics and control in one compiled call per tick: five steps of 4 ms, then what each autopilot sees."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from missions import obstacles
from missions.frames import swap_enu_ned
from missions.kernels import compiled
from missions.mission import Mission
from missions.obstacles import Obstacles
from sitl.control.attitude_control import attitude_control, rate_control, reset_rate_control
from sitl.control.gains import GAINS
from sitl.control.guidance import guide, hold_still
from sitl.control.land_detection import detect_landing
from sitl.control.position_control import position_control
from sitl.dynamics.airframe import GRAVITY_M_S2, Airframe
from sitl.dynamics.contact import touch_each_other, touch_ground, touch_obstacles
from sitl.dynamics.rigid_body import move, thrust_of
from sitl.dynamics.rotation import body_z
from sitl.dynamics.state import Guidance, TakeoffStage, new_fleet
from sitl.estimator import (
    NORMALS_PER_TICK,
    Wandering,
    estimate_attitude,
    locate,
    set_noise,
    start_estimators,
    wander,
    wandering,
)
from sitl.geodesy import MissionOrigin, mission_origin
from sitl.snapshot import Snapshot, new_rows, observe

Array = npt.NDArray[np.float64]

STEP_S = 0.004
STEPS_PER_TICK = 5
TICK_S = STEP_S * STEPS_PER_TICK
NO_MOVERS = np.zeros((0, 4))

_MOTORS_OFF, _ATTITUDE, _RATES = (int(Guidance[name]) for name in ("MOTORS_OFF", "ATTITUDE", "RATES"))
_SURVIVES_RESTART = (
    *("position_m", "velocity_m_s", "attitude", "rates_rad_s", "specific_force_m_s2", "rotor", "rotor_health"),
    *("gust_m_s", "grounded", "crash", "crash_other", "position_std_m", "velocity_std_m_s", "dead_reckoning"),
)
"""What of a vehicle's record is body and world, and not its autopilot's."""

_FLIGHT, _NOT_TAKEN_OFF = int(TakeoffStage.FLIGHT), int(TakeoffStage.DISARMED)


class Fleet:
    """All vehicles of a mission as bodies that fly; no MAVLink, no modes.

    Args:
        mission: where the vehicles stand, what stands around them, how well they know where they are.
        airframe: the body of every vehicle.
        rng: source of all randomness; one state of it, one flight.
    """

    def __init__(self, mission: Mission, airframe: Airframe, rng: np.random.Generator) -> None:
        simulation = mission.simulation
        self.vehicles = new_fleet(len(mission.vehicles))
        self.gains = np.zeros(len(mission.vehicles), dtype=GAINS)
        self._airframe = airframe.record
        self._rng = rng
        self._solid, self._terrain = _solid_and_terrain(mission)
        self._movers = mission.world.movers
        self._body_radius_m = mission.limits.body_radius_m
        self._wind_ned_m_s = swap_enu_ned(np.array(simulation.wind_enu_m_s))
        self._positioning, self._frame = simulation.positioning, mission.frame
        self._wandering = wandering(simulation.positioning, simulation.gust_std_m_s, TICK_S)
        self._origin = mission_origin(mission.origin)
        self._rows = new_rows(len(mission.vehicles))
        pads = np.array([vehicle.pad_m for vehicle in mission.vehicles], dtype=float)
        pads[:, 2] = np.maximum(pads[:, 2], obstacles.terrain_height(pads, self._terrain))
        self.vehicles["position_m"] = swap_enu_ned(pads)
        noise = simulation.positioning
        set_noise(self.vehicles, noise.horizontal_std_m, noise.vertical_std_m, noise.velocity_std_m_s)
        start_estimators(self.vehicles, mission.frame, simulation.positioning, rng)

    def advance(self, time_s: float) -> list[Snapshot]:
        """Move everything by one tick of 20 ms from `time_s` on; returns each vehicle's view afterwards."""
        normals = self._rng.standard_normal((len(self.vehicles), NORMALS_PER_TICK))
        advance(
            self.vehicles,
            self.gains,
            self._airframe,
            self._solid,
            self._terrain,
            self._mover_rows(time_s),
            self._body_radius_m,
            self._wind_ned_m_s,
            normals,
            self._wandering,
            self._origin,
            self._rows,
        )
        return [Snapshot._make(row) for row in self._rows.tolist()]

    def views(self) -> list[Snapshot]:
        """What each autopilot sees, without moving anything."""
        view(self.vehicles, self._origin, self._rows)
        return [Snapshot._make(row) for row in self._rows.tolist()]

    # ----------------------------------------------------------------- faults
    def set_weather(self, wind_enu_m_s: Sequence[float], gust_std_m_s: float) -> None:
        """Change the wind and how strongly it gusts, for all vehicles."""
        self._wind_ned_m_s = swap_enu_ned(np.array(wind_enu_m_s, dtype=float))
        self._wandering = self._wandering._replace(gust_std_m_s=gust_std_m_s)

    def set_noise(self, index: int, *, horizontal_std_m: float, vertical_std_m: float, velocity_std_m_s: float) -> None:
        """Change how far one vehicle's estimates wander."""
        set_noise(self.vehicles[index : index + 1], horizontal_std_m, vertical_std_m, velocity_std_m_s)

    def lose_positioning(self, index: int, *, lost: bool) -> None:
        """Take one vehicle the source of its position, or give it back."""
        self.vehicles["dead_reckoning"][index] = lost

    def fail_rotor(self, index: int, rotor: int, health: float) -> None:
        """Let a rotor (0 to 3) follow only a share of its signal: 0 is a failure, 1 is whole."""
        self.vehicles["rotor_health"][index, rotor] = health

    def stop_motors(self, index: int) -> None:
        """One vehicle's autopilot is gone."""
        self.vehicles["guidance"][index] = Guidance.MOTORS_OFF

    def restart_autopilot(self, index: int) -> None:
        """Control and estimator of one vehicle begin anew, the estimator with an origin where it sees itself now."""
        body, fresh = self.vehicles[index : index + 1], new_fleet(1)
        for name in _SURVIVES_RESTART:
            fresh[name] = body[name]
        body[:] = fresh
        start_estimators(body, self._frame, self._positioning, self._rng)

    @property
    def positions_enu_m(self) -> Array:
        """(n, 3) true positions, mission frame."""
        return swap_enu_ned(self.vehicles["position_m"])

    @property
    def velocities_enu_m_s(self) -> Array:
        """(n, 3) true velocities, mission frame."""
        return swap_enu_ned(self.vehicles["velocity_m_s"])

    def _mover_rows(self, time_s: float) -> Array:
        """(k, 4) centre NED and radius [m] of the world's movers."""
        if not self._movers:
            return NO_MOVERS
        return np.array([(*swap_enu_ned(mover.position(time_s)), mover.radius_m) for mover in self._movers])


def _solid_and_terrain(mission: Mission) -> tuple[Obstacles, Obstacles]:
    """What vehicles collide with, and the peaks, which are ground: the true world, without its threats."""
    world = obstacles.pack(mission.world, with_threats=False)
    return world._replace(peaks=np.zeros((0, 5))), world


@compiled
def advance(
    fleet: Any,
    gains: Any,
    airframe: Any,
    solid: Obstacles,
    terrain: Obstacles,
    movers: Array,
    body_radius_m: float,
    wind_ned_m_s: Array,
    normals: Array,
    wandering: Wandering,
    origin: MissionOrigin,
    rows: Array,
) -> None:
    """One tick of the whole fleet, in place."""
    n = len(fleet)
    for i in range(n):
        wander(fleet[i], normals[i], wandering)
        locate(fleet[i], origin)
    for _ in range(STEPS_PER_TICK):
        for i in range(n):
            control(fleet[i], gains[i])
            move(fleet[i], airframe[0], wind_ned_m_s, STEP_S)
            touch_ground(fleet[i], terrain, lift(fleet[i], airframe[0]))
            touch_obstacles(fleet[i], solid, movers, body_radius_m)
        touch_each_other(fleet, body_radius_m)
    for i in range(n):
        estimate_attitude(fleet[i])
        observe(fleet[i], rows[i])


@compiled
def view(fleet: Any, origin: MissionOrigin, rows: Array) -> None:
    """Write what each autopilot sees into (n, N_FIELDS) `rows`."""
    for i in range(len(fleet)):
        locate(fleet[i], origin)
        estimate_attitude(fleet[i])
        observe(fleet[i], rows[i])


@compiled
def control(v: Any, g: Any) -> None:
    """One step of one autopilot's control, from guidance to the rotors' signals."""
    estimate_attitude(v)
    if v.guidance == _MOTORS_OFF:
        _rest(v)
    else:
        if v.guidance == _ATTITUDE or v.guidance == _RATES:
            hold_still(v)
            v.takeoff_stage = _FLIGHT
        else:
            position_control(v, g, guide(v, g, STEP_S), STEP_S)
        if v.guidance != _RATES:
            attitude_control(v, g)
        rate_control(v, g, STEP_S)
    detect_landing(v, g, STEP_S)


@compiled
def _rest(v: Any) -> None:
    """Disarmed: nothing turns, nothing is remembered."""
    hold_still(v)
    reset_rate_control(v)
    v.takeoff_stage = _NOT_TAKEN_OFF
    v.stage_s = 0.0
    v.setpoint_thrust = 0.0
    v.tilt_limit_rad = 0.0
    for k in range(3):
        v.velocity_integral_m_s2[k] = 0.0
    for k in range(4):
        v.motor[k] = 0.0


@compiled
def lift(v: Any, a: Any) -> float:
    """The rotors' vertical thrust in weights of the vehicle."""
    thrust = 0.0
    for k in range(4):
        thrust += thrust_of(v.rotor[k], a)
    q = (v.attitude[0], v.attitude[1], v.attitude[2], v.attitude[3])
    return thrust * body_z(q)[2] / (a.mass_kg * GRAVITY_M_S2)
