"""A scan: what a range sensor has seen at one moment, in the mission's frame; whatever the sensor was."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Scan:
    """Surfaces that were hit; where nothing was hit there is no point, so that a direction without one says little.

    Args:
        time_s: vehicle time at which it was taken.
        sensor_enu_m: (3,) where the sensor was, mission ENU.
        points_enu_m: (n, 3) hits, mission ENU; n may be 0. Other vehicles and the ground are among them.
        range_m: how far the sensor looks.
    """

    time_s: float
    sensor_enu_m: Array
    points_enu_m: Array
    range_m: float
