"""The steps that a real PX4 was measured with, flown by MAVLink on one calm vehicle, and what is read off each."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from missions.mission import Mission, Positioning, Simulation
from sitl.dialect import Message, mavlink
from sitl.dynamics.airframe import Airframe
from sitl.microservices.outbox import Link
from sitl.open_field import open_field
from sitl.simulator import Simulator

Array = npt.NDArray[np.float64]

NAN = math.nan
POSITION, VELOCITY = 0x9F8, 0x9C7
"""Type masks: position and yaw, velocity and yaw."""
STREAM_S = 0.05
"""Setpoints are repeated this often; a change waits for half of it, as it does on average in such a stream."""
CALM = Positioning(horizontal_std_m=0.0, vertical_std_m=0.0, velocity_std_m_s=0.0)
"""Of an estimator that knows everything."""
GNSS = Positioning(horizontal_std_m=0.45, vertical_std_m=0.45, velocity_std_m_s=0.08, correlation_s=7.0)
"""Of one on a GNSS receiver like the one in PX4's simulation in hardware."""


@dataclass(frozen=True)
class Recording:
    """What a vehicle did: (n,) times [s] from the step on, (n, 3) NED positions and velocities, tilts, headings."""

    time_s: Array
    position_m: Array
    velocity_m_s: Array
    tilt_deg: Array
    yaw_deg: Array

    def time_to(self, values: Array, level: float) -> float:
        """When `values` first reaches `level` (from below); NaN if never."""
        reached = np.nonzero(values >= level)[0]
        return float(self.time_s[reached[0]]) if len(reached) else NAN


class Pilot:
    """Flies one vehicle of the simulator by MAVLink, and watches where it really goes."""

    def __init__(self, airframe: Airframe, positioning: Positioning = CALM) -> None:
        self._simulator = Simulator(located(open_field(1), positioning), seed=1, airframe=airframe)
        self._codec = mavlink.MAVLink(None, 1, 191)
        self._setpoint: Message | None = None
        self._send_s = 0.0
        self.disarmed_s = 0.0
        """Simulated time until which the vehicle has been armed."""
        self.wait(1.0)

    @property
    def position_m(self) -> Array:
        """(3,) NED."""
        east, north, up = self._simulator.truth.position_enu_m[0]
        return np.array([north, east, -up])

    @property
    def time_s(self) -> float:
        """Simulated time since boot."""
        return self._simulator.time_s

    def send(self, message: Message) -> None:
        self._simulator.receive(1, Link.ONBOARD, message.pack(self._codec))

    def command(self, number: int, *params: float) -> None:
        padded = (*params, *(0.0,) * (7 - len(params)))
        self.send(mavlink.MAVLink_command_long_message(1, 1, number, 0, *padded))

    def order(self, mask: int, position_m: Array, velocity_m_s: Array, yaw_rad: float = 0.0) -> None:
        """The offboard setpoint from now on."""
        motion = (*position_m.tolist(), *velocity_m_s.tolist(), 0.0, 0.0, 0.0)
        message: Any = mavlink.MAVLink_set_position_target_local_ned_message
        self._setpoint = message(0, 1, 1, mavlink.MAV_FRAME_LOCAL_NED, mask, *motion, yaw_rad, 0.0)
        self._send_s = self.time_s + 0.5 * STREAM_S

    def go_offboard(self) -> None:
        """Hover in Offboard, where the vehicle is, after a take-off to 20 m."""
        self.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, NAN, NAN, NAN, 489.4 + 20.0)
        self.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
        self.wait(30.0)
        self.hover()
        self.wait(0.1)
        self.command(mavlink.MAV_CMD_DO_SET_MODE, 1, 6)
        self.wait(8.0)

    def hover(self) -> None:
        self.order(POSITION, np.array([0.0, 0.0, -20.0]), np.zeros(3))

    def wait(self, duration_s: float) -> Recording:
        """Let time pass, setpoints going out; where the vehicle really goes."""
        return self._record(duration_s, self._state)

    def watch(self, duration_s: float) -> Recording:
        """The same as the vehicle itself sees it."""
        return self._record(duration_s, self._estimate)

    def _record(self, duration_s: float, state: Callable[[], tuple[float, ...]]) -> Recording:
        begin_s = self._simulator.time_s
        rows: list[tuple[float, ...]] = []
        while self._simulator.time_s < begin_s + duration_s - 1e-9:
            if self._setpoint is not None and self.time_s > self._send_s - 1e-9:
                self._send_s += STREAM_S
                self.send(self._setpoint)
            self._simulator.step()
            self._simulator.transmissions()
            rows.append((self._simulator.time_s - begin_s, *state()))
            if self._simulator.vehicles[1].autopilot.armed:
                self.disarmed_s = self._simulator.time_s
        table = np.array(rows)
        return Recording(table[:, 0], table[:, 1:4], table[:, 4:7], table[:, 7], table[:, 8])

    def _estimate(self) -> tuple[float, ...]:
        s = self._simulator.vehicles[1].autopilot.snapshot
        tilt = math.degrees(math.acos(math.cos(s.roll_rad) * math.cos(s.pitch_rad)))
        return s.x_m, s.y_m, s.z_m, s.vx_m_s, s.vy_m_s, s.vz_m_s, tilt, math.degrees(s.yaw_rad)

    def _state(self) -> tuple[float, ...]:
        truth = self._simulator.truth
        east, north, up = truth.position_enu_m[0]
        ve, vn, vu = truth.velocity_enu_m_s[0]
        w, x, y, z = truth.attitude_ned_frd[0]
        tilt = math.degrees(math.acos(max(-1.0, min(1.0, w * w - x * x - y * y + z * z))))
        yaw = math.degrees(math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))
        return north, east, -up, vn, ve, -vu, tilt, yaw


def hover(airframe: Airframe, *, offboard: bool) -> dict[str, float]:
    """Hovering on noisy estimates in Hold or Offboard, as the estimates show it: means over several times 30 s."""
    pilot = Pilot(airframe, GNSS)
    pilot.go_offboard()
    if not offboard:
        pilot.command(mavlink.MAV_CMD_DO_SET_MODE, 1, 4, 3)
        pilot.wait(5.0)
    hovers = [pilot.watch(30.0) for _ in range(10)]
    place = np.array([0.0, 0.0, -20.0])
    off = [(r.position_m - (place if offboard else r.position_m.mean(axis=0))) for r in hovers]
    position = np.mean([np.sqrt((one**2).mean(axis=0)) for one in off], axis=0)
    velocity = np.mean([np.sqrt((r.velocity_m_s**2).mean(axis=0)) for r in hovers], axis=0)
    return {
        "across m": float(np.hypot(position[0], position[1]) / math.sqrt(2.0)),
        "height m": float(position[2]),
        "across m/s": float(np.hypot(velocity[0], velocity[1]) / math.sqrt(2.0)),
        "climb m/s": float(velocity[2]),
        "peak tilt deg": float(np.mean([r.tilt_deg.max() for r in hovers])),
    }


def located(mission: Mission, positioning: Positioning) -> Mission:
    """The mission with estimators that are this good."""
    return msgspec.structs.replace(mission, simulation=Simulation(positioning=positioning))


def position_step(airframe: Airframe, axis: int, distance_m: float) -> dict[str, float]:
    """A step of the position setpoint along one NED axis."""
    pilot = Pilot(airframe)
    pilot.go_offboard()
    begin = pilot.position_m
    target = begin.copy()
    target[axis] += distance_m
    pilot.order(POSITION, target, np.zeros(3))
    r = pilot.wait(15.0)
    share = (r.position_m[:, axis] - begin[axis]) / distance_m
    return {
        "t10 s": r.time_to(share, 0.1),
        "t63 s": r.time_to(share, 0.63),
        "t90 s": r.time_to(share, 0.9),
        "overshoot %": max(0.0, float(share.max() - 1.0) * 100.0),
        "peak m/s": float(np.abs(r.velocity_m_s[:, axis]).max()),
        "peak tilt deg": float(r.tilt_deg.max()),
    }


def velocity_step(
    airframe: Airframe, axis: int, speed_m_s: float, after_s: float, reached_m_s: float | None = None
) -> dict[str, float]:
    """A step of the velocity setpoint along one NED axis; shares are of `reached_m_s` where a limit is lower."""
    pilot = Pilot(airframe)
    pilot.go_offboard()
    wanted = np.zeros(3)
    wanted[axis] = speed_m_s
    pilot.order(VELOCITY, np.zeros(3), wanted)
    r = pilot.wait(after_s)
    share = r.velocity_m_s[:, axis] / (reached_m_s or speed_m_s)
    return {
        "t63 s": r.time_to(share, 0.63),
        "t90 s": r.time_to(share, 0.9),
        "value m/s": abs(float(r.velocity_m_s[-25:, axis].mean())),
        "overshoot %": max(0.0, float(share.max() - 1.0) * 100.0),
        "peak tilt deg": float(r.tilt_deg.max()),
    }


def brake(airframe: Airframe, speed_m_s: float) -> dict[str, float]:
    """From a steady speed to none."""
    pilot = Pilot(airframe)
    pilot.go_offboard()
    pilot.order(VELOCITY, np.zeros(3), np.array([speed_m_s, 0.0, 0.0]))
    pilot.wait(12.0)
    begin = pilot.position_m
    pilot.order(VELOCITY, np.zeros(3), np.zeros(3))
    r = pilot.wait(7.0)
    slowed = 1.0 - r.velocity_m_s[:, 0] / r.velocity_m_s[0, 0]
    return {
        "t63 s": r.time_to(slowed, 0.63),
        "t90 s": r.time_to(slowed, 0.9),
        "distance m": float(r.position_m[-1, 0] - begin[0]),
        "peak tilt deg": float(r.tilt_deg.max()),
    }


def yaw_step(airframe: Airframe) -> dict[str, float]:
    """A quarter turn."""
    pilot = Pilot(airframe)
    pilot.go_offboard()
    pilot.order(POSITION, np.array([0.0, 0.0, -20.0]), np.zeros(3), yaw_rad=0.5 * math.pi)
    r = pilot.wait(5.0)
    rate = np.gradient(r.yaw_deg, r.time_s)
    return {
        "t90 s": r.time_to(r.yaw_deg / 90.0, 0.9),
        "overshoot %": max(0.0, float(r.yaw_deg.max() / 90.0 - 1.0) * 100.0),
        "peak deg/s": float(rate.max()),
    }


def takeoff(airframe: Airframe) -> dict[str, float]:
    """Takeoff mode to 20 m; times from arming."""
    pilot = Pilot(airframe)
    pilot.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, NAN, NAN, NAN, 489.4 + 20.0)
    pilot.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    r = pilot.wait(30.0)
    height = -r.position_m[:, 2]
    return {
        "t 0.3 m": r.time_to(height, 0.3),
        "t 5 m": r.time_to(height, 5.0),
        "t 15 m": r.time_to(height, 15.0),
        "t 19.3 m": r.time_to(height, 19.3),
        "peak m/s": float(-r.velocity_m_s[:, 2].min()),
    }


def reposition(airframe: Airframe) -> dict[str, float]:
    """Hold, sent 50 m north."""
    pilot = Pilot(airframe)
    pilot.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, NAN, NAN, NAN, 489.4 + 20.0)
    pilot.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    pilot.wait(30.0)
    latitude_deg = 47.3977432 + math.degrees(50.0 / 6_371_000.0)
    pilot.command(mavlink.MAV_CMD_DO_REPOSITION, -1, 1, 0, NAN, latitude_deg, 8.5455942, 489.4 + 20.0)
    r = pilot.wait(25.0)
    share = r.position_m[:, 0] / 50.0
    return {
        "t90 s": r.time_to(share, 0.9),
        "cruise m/s": float(np.median(r.velocity_m_s[(share > 0.3) & (share < 0.6), 0])),
        "overshoot %": max(0.0, float(share.max() - 1.0) * 100.0),
        "peak tilt deg": float(r.tilt_deg.max()),
    }


def land(airframe: Airframe) -> dict[str, float]:
    """Land mode from 20 m."""
    pilot = Pilot(airframe)
    pilot.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, NAN, NAN, NAN, 489.4 + 20.0)
    pilot.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    pilot.wait(30.0)
    begin_s = pilot.time_s
    pilot.command(mavlink.MAV_CMD_NAV_LAND)
    r = pilot.wait(40.0)
    height, sink = -r.position_m[:, 2], r.velocity_m_s[:, 2]
    return {
        "high m/s": float(np.median(sink[(height > 11.0) & (height < 17.0)])),
        "7.5 m m/s": float(np.median(sink[(height > 7.0) & (height < 8.0)])),
        "low m/s": float(np.median(sink[(height > 2.0) & (height < 4.0)])),
        "disarmed s": pilot.disarmed_s - begin_s,
    }
