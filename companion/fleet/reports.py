"""What is said on the fleet link: plans, and positions for everybody who does not understand plans."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from missions.tunnel import TrajectoryMessage

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class PlanReport:
    """What a vehicle says that it flies, or will fly; its times are UTC [s]."""

    sysid: int
    message: TrajectoryMessage


@dataclass(frozen=True)
class PositionReport:
    """Where a vehicle says that it is (UTM_GLOBAL_POSITION).

    Args:
        sysid: of the vehicle.
        utc_s: when it was there; None when it does not know the time.
        position_m: (3,) mission ENU.
        velocity_m_s: (3,) mission ENU.
        error_m: how far off the position may be.
        on_ground: it stands.
    """

    sysid: int
    utc_s: float | None
    position_m: Array
    velocity_m_s: Array
    error_m: float
    on_ground: bool


Report = PlanReport | PositionReport
