"""What can happen to a pilot: the one door in. Events are facts; the vehicle time goes along with them."""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from companion.planner.planner import Plan
from missions.frames import GeodeticPoint
from missions.mission_items import MissionItem
from missions.tunnel import Receipt

Array = npt.NDArray[np.float64]


class FlightMode(Enum):
    """The autopilot's modes, as far as a companion tells them apart."""

    OFFBOARD = "offboard"
    HOLD = "hold"
    TAKEOFF = "takeoff"
    LAND = "land"
    RTL = "rtl"
    MISSION = "mission"
    OTHER = "other"


@dataclass(frozen=True)
class AutopilotFound:
    """The autopilot is there, or there again."""


@dataclass(frozen=True)
class AutopilotLost:
    """Its heartbeats have stopped."""


@dataclass(frozen=True)
class Odometry:
    """One estimate of the vehicle's state.

    Args:
        time_s: vehicle time of the estimate.
        position_m: (3,) in the autopilot's NED frame.
        velocity_m_s: (3,) in the autopilot's NED frame.
        attitude: (4,) unit quaternion w, x, y, z, body FRD -> NED.
    """

    time_s: float
    position_m: Array
    velocity_m_s: Array
    attitude: Array

    @property
    def yaw_rad(self) -> float:
        """Heading, 0 north, clockwise."""
        w, x, y, z = self.attitude.tolist()
        return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


@dataclass(frozen=True)
class OriginReported:
    """Where the autopilot's NED frame has its origin (GPS_GLOBAL_ORIGIN)."""

    origin: GeodeticPoint


@dataclass(frozen=True)
class HomeReported:
    """Where the autopilot says that it took off, or stands (HOME_POSITION)."""

    home: GeodeticPoint


@dataclass(frozen=True)
class ModeReported:
    """The autopilot's present mode."""

    mode: FlightMode


@dataclass(frozen=True)
class ArmingReported:
    """Whether the motors may turn."""

    armed: bool


@dataclass(frozen=True)
class LandedReported:
    """Whether the autopilot believes to stand on the ground."""

    on_ground: bool


@dataclass(frozen=True)
class UtcReported:
    """UTC [s] minus vehicle time [s]."""

    ahead_s: float


@dataclass(frozen=True)
class MissionReported:
    """MISSION_CURRENT: which mission is stored, and which item is current.

    Args:
        identity: changes with the stored mission; 0 when there is none.
        current_seq: of the item that is flown to.
    """

    identity: int
    current_seq: int


@dataclass(frozen=True)
class MissionDownloaded:
    """The answer to a download; `items` is None when it failed."""

    identity: int
    items: tuple[MissionItem, ...] | None


@dataclass(frozen=True)
class Sender:
    """Who sent a command: MAVLink system and component."""

    system: int
    component: int


@dataclass(frozen=True)
class StartCommanded:
    """MAV_CMD_MISSION_START, addressed to this companion."""

    sender: Sender


@dataclass(frozen=True)
class ModeCommandEnded:
    """The autopilot's answer to a mode that the pilot has commanded."""

    mode: FlightMode
    accepted: bool


@dataclass(frozen=True)
class PlanReady:
    """The planner's answer, and the CPU time that it took."""

    plan: Plan
    cpu_ms: float


@dataclass(frozen=True)
class RingReported:
    """OBSTACLE_DISTANCE, its fields as JSON; for the sensor's driver."""

    fields_json: bytes


@dataclass(frozen=True)
class ReceiptHeard:
    """How much of the companion's reports a ground station has heard."""

    sender: Sender
    receipt: Receipt


@dataclass(frozen=True)
class StopRequested:
    """The program shall end: SIGTERM, Ctrl-C, or its parent is gone."""


@dataclass(frozen=True)
class Tick:
    """Fifty times a second of vehicle time.

    Args:
        odometry_age_s: vehicle time since the last odometry arrived.
        lateness_ms: by how much this tick came late (wall clock).
        sensor_silent: there is to be a range sensor, and it is not heard.
    """

    odometry_age_s: float
    lateness_ms: float = 0.0
    sensor_silent: bool = False


Event = (
    AutopilotFound
    | AutopilotLost
    | Odometry
    | OriginReported
    | HomeReported
    | ModeReported
    | ArmingReported
    | LandedReported
    | UtcReported
    | MissionReported
    | MissionDownloaded
    | StartCommanded
    | ModeCommandEnded
    | PlanReady
    | RingReported
    | ReceiptHeard
    | StopRequested
    | Tick
)
