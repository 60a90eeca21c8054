"""What goes wrong beside the simulator's faults and companions' ends: with the ground station, sensors and restarts."""

from enum import Enum

import msgspec

from gcs.flight.monitor import Phase


class Timed(msgspec.Struct, frozen=True, kw_only=True):
    """What happens so long after the first vehicle has come to a phase."""

    phase: Phase
    after_s: float


class GroundCrash(Timed, frozen=True, kw_only=True, tag="ground-crash"):
    """The ground station ends at once, and is started again after a while, on the journal that it left."""

    down_s: float


class GroundHang(Timed, frozen=True, kw_only=True, tag="ground-hang"):
    """The ground station neither reads nor writes for a while; then all that has waited comes at once."""

    lasts_s: float


class WallClockJump(Timed, frozen=True, kw_only=True, tag="wall-clock-jump"):
    """The ground's wall clock is set."""

    by_s: float


class CompanionRestart(msgspec.Struct, frozen=True, kw_only=True, tag="companion-restart"):
    """A companion that a fault has ended is started again."""

    vehicle: int
    down_s: float


class LidarSilence(Timed, frozen=True, kw_only=True, tag="lidar-silence"):
    """A companion's range sensor says nothing for a while."""

    vehicle: int
    lasts_s: float


class DiskFull(Timed, frozen=True, kw_only=True, tag="disk-full"):
    """Nothing more can be written to any file of the ground station's."""


class OtherOrder(Enum):
    """What somebody else's ground station orders."""

    NOTHING = "nothing"
    LAND = "land"
    RETURN = "return"
    HOLD_AND_GO_ON = "hold-and-go-on"


class SecondStation(Timed, frozen=True, kw_only=True, tag="second-station"):
    """Another ground station comes to a vehicle's link, and orders something."""

    vehicle: int
    order: OtherOrder


class Namesake(Timed, frozen=True, kw_only=True, tag="namesake"):
    """A second vehicle with a system id that is taken is heard for a while, from somewhere else."""

    vehicle: int
    lasts_s: float


Mishap = (
    GroundCrash | GroundHang | WallClockJump | LidarSilence | CompanionRestart | DiskFull | SecondStation | Namesake
)
