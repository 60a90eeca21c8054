"""Where a camera has to be so that a whole box is in the picture; pure geometry."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

FOV_RAD = np.deg2rad(45.0)
"""Vertical field of view of the page's cameras."""

FROM_SOUTH_WEST = np.array([-0.5, -0.8, 0.72])
FROM_ABOVE = np.array([0.0, -1e-3, 1.0])
"""Straight down has no up direction: a hair from the south, so that north is up in the picture."""


@dataclass(frozen=True)
class Pose:
    """A camera's place and what it looks at, ENU [m]; its up direction is the world's."""

    position_m: Array
    look_at_m: Array


@dataclass(frozen=True)
class Margins:
    """Shares of the picture's width and height that stay free of the world: panels lie over them, or air is wanted."""

    side: float = 0.05
    top: float = 0.08
    bottom: float = 0.05


def camera_axes(towards_camera: Array) -> tuple[Array, Array, Array]:
    """Unit vectors (3,) to the right, upwards and towards the camera of a picture taken from a direction."""
    back = towards_camera / np.linalg.norm(towards_camera)
    right = np.array([-back[1], back[0], 0.0]) / np.hypot(back[0], back[1])
    up = np.array([-back[2] * right[1], back[2] * right[0], back[0] * right[1] - back[1] * right[0]])
    return right, up, back


def frame_box(low_m: Array, high_m: Array, towards_camera: Array, aspect: float, margins: Margins) -> Pose:
    """The nearest pose from which a box fills the free part of the picture.

    Args:
        low_m: (3,) lowest corner.
        high_m: (3,) highest corner.
        towards_camera: (3,) direction from the box to the camera.
        aspect: width / height of the picture.
        margins: what is kept free.
    """
    axes = np.stack(camera_axes(towards_camera))
    centre_m = (low_m + high_m) / 2
    grid = np.stack(np.meshgrid(*zip(low_m, high_m, strict=True), indexing="ij"), axis=-1)
    corners = (grid.reshape(-1, 3) - centre_m) @ axes.T
    half_up = np.tan(FOV_RAD / 2)
    wide = half_up * aspect * (1.0 - 2.0 * margins.side)
    above, below = half_up * (1.0 - 2.0 * margins.top), half_up * (1.0 - 2.0 * margins.bottom)
    distance_m, shift_m = _distance(corners, wide, above, below)
    look_at_m = centre_m + shift_m * axes[1]
    return Pose(look_at_m + distance_m * axes[2], look_at_m)


def _distance(corners: Array, wide: float, above: float, below: float) -> tuple[float, float]:
    """How far off the camera must be, and how far up its axis shifted: a corner (x, y, z) has depth d - z.

    In the picture lies what keeps |x| <= wide (d - z) and -below (d - z) <= y - s <= above (d - z), for a shift s.
    """
    x, y, z = corners.T
    sides = float(np.max(np.abs(x) / wide + z))
    # the two vertical limits leave a shift between them: y - above (d - z) <= s <= y + below (d - z) for all corners
    pairs = (y[:, None] - y[None, :] + above * z[:, None] + below * z[None, :]) / (above + below)
    distance = max(sides, float(np.max(pairs)))
    lowest, highest = np.max(y - above * (distance - z)), np.min(y + below * (distance - z))
    return distance, float(lowest + highest) / 2
