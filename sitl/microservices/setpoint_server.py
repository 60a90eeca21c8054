"""SET_POSITION_TARGET_LOCAL_NED, ..._GLOBAL_INT, SET_ATTITUDE_TARGET, for Offboard, and FOLLOW_TARGET, for Follow."""

import math

from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.offboard import Ignore, IgnoreAttitude, PositionTarget
from sitl.autopilot.places import is_place
from sitl.dialect import Message

ALL_BITS = 0x0FFF


class SetpointServer:
    """Reads setpoint messages."""

    def __init__(self, autopilot: Autopilot) -> None:
        self._autopilot = autopilot

    def receive_local(self, message: Message, now_s: float) -> None:
        m = message
        target = _target(m, (m.x, m.y, m.z))
        self._autopilot.offboard.receive_local(target, self._autopilot.snapshot, now_s)

    def receive_global(self, message: Message, now_s: float) -> None:
        m = message
        craft = self._autopilot.craft
        place = m.lat_int * 1e-7, m.lon_int * 1e-7, m.alt
        target = _target(m, (0.0, 0.0, 0.0))
        self._autopilot.offboard.receive_global(target, place, craft.frame, craft.home_altitude_m, now_s)

    def receive_follow_target(self, message: Message, now_s: float) -> None:
        """FOLLOW_TARGET, which has no receiver: Follow keeps near it; a velocity that is none counts as zero."""
        m, autopilot = message, self._autopilot
        latitude_deg, longitude_deg = m.lat * 1e-7, m.lon * 1e-7
        if is_place(latitude_deg, longitude_deg) and math.isfinite(m.alt):
            north, east = (v if math.isfinite(v) else 0.0 for v in m.vel[:2])
            point = autopilot.craft.frame.local(latitude_deg, longitude_deg, m.alt)
            autopilot.navigator.follow.receive(point, (north, east), now_s)

    def receive_attitude(self, message: Message, now_s: float) -> None:
        m = message
        rates = m.body_roll_rate, m.body_pitch_rate, m.body_yaw_rate
        ignore = IgnoreAttitude(m.type_mask & 0xC7)
        self._autopilot.offboard.receive_attitude(ignore, m.q, rates, m.thrust, now_s)


def _target(m: Message, position: tuple[float, float, float]) -> PositionTarget:
    return PositionTarget(
        frame=m.coordinate_frame,
        ignore=Ignore(m.type_mask & ALL_BITS),
        velocity_m_s=(m.vx, m.vy, m.vz),
        acceleration_m_s2=(m.afx, m.afy, m.afz),
        yaw_rad=m.yaw,
        yawspeed_rad_s=m.yaw_rate,
        position_m=position,
    )
