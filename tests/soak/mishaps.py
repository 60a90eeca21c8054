"""What goes wrong beside the simulator's faults and companions' ends: with the ground station, sensors and restarts."""

import msgspec

from gcs.flight.monitor import Phase


class GroundCrash(msgspec.Struct, frozen=True, kw_only=True, tag="ground-crash"):
    """The ground station ends at once, and is started again after a while, on the journal that it left."""

    phase: Phase
    """It happens so long after the first vehicle has come to this phase."""
    after_s: float
    down_s: float


class GroundHang(msgspec.Struct, frozen=True, kw_only=True, tag="ground-hang"):
    """The ground station neither reads nor writes for a while; then all that has waited comes at once."""

    phase: Phase
    after_s: float
    lasts_s: float


class WallClockJump(msgspec.Struct, frozen=True, kw_only=True, tag="wall-clock-jump"):
    """The ground's wall clock is set."""

    phase: Phase
    after_s: float
    by_s: float


class CompanionRestart(msgspec.Struct, frozen=True, kw_only=True, tag="companion-restart"):
    """A companion that a fault has ended is started again."""

    vehicle: int
    down_s: float


class LidarSilence(msgspec.Struct, frozen=True, kw_only=True, tag="lidar-silence"):
    """A companion's range sensor says nothing for a while."""

    vehicle: int
    phase: Phase
    after_s: float
    lasts_s: float


Timed = GroundCrash | GroundHang | WallClockJump | LidarSilence
Mishap = Timed | CompanionRestart
