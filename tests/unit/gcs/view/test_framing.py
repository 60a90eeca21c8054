"""The whole world is in the picture."""

import numpy as np
import pytest

from gcs.view.framing import FOV_RAD, FROM_ABOVE, FROM_SOUTH_WEST, Margins, Pose, camera_axes, frame_box

ROOM = (np.array([0.0, 0.0, 0.0]), np.array([20.0, 15.0, 4.0]))
RANGE = (np.array([-50.0, -50.0, 0.0]), np.array([2050.0, 2050.0, 1000.0]))


def in_picture(pose: Pose, points_m: np.ndarray, aspect: float) -> np.ndarray:
    """(n, 2) places in the picture, both axes from -1 (left, bottom) to 1 (right, top)."""
    right, up, back = camera_axes(pose.position_m - pose.look_at_m)
    relative = points_m - pose.position_m
    depth, half = -relative @ back, np.tan(FOV_RAD / 2)
    return np.stack((relative @ right / (half * aspect), relative @ up / half), axis=1) / depth[:, None]


def corners(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    return np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


@pytest.mark.parametrize("towards", [FROM_SOUTH_WEST, FROM_ABOVE])
@pytest.mark.parametrize("aspect", [0.6, 1.3, 2.4])
@pytest.mark.parametrize("box", [ROOM, RANGE])
def test_every_corner_is_inside_the_margins_and_the_picture_is_filled(box, aspect: float, towards: np.ndarray):
    margins = Margins(side=0.03, top=0.08, bottom=0.3)
    seen = in_picture(frame_box(*box, towards, aspect, margins), corners(*box), aspect)
    free = np.array([1.0 - 2.0 * margins.side, 1.0 - 2.0 * margins.top, 1.0 - 2.0 * margins.bottom])
    used = np.array([np.abs(seen[:, 0]).max(), seen[:, 1].max(), -seen[:, 1].min()]) / free
    assert np.all(used <= 1.0 + 1e-9)
    assert max(used[0], min(used[1], used[2])) == pytest.approx(1.0)


def test_the_first_view_is_from_the_south_west_and_above():
    pose = frame_box(*ROOM, FROM_SOUTH_WEST, 1.4, Margins())
    east, north, up = pose.position_m - pose.look_at_m
    assert east < 0.0
    assert north < 0.0
    assert up > 0.0


def test_from_above_north_is_up():
    pose = frame_box(*ROOM, FROM_ABOVE, 1.4, Margins())
    right, up, _ = camera_axes(pose.position_m - pose.look_at_m)
    np.testing.assert_allclose(right, [1.0, 0.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(up, [0.0, 1.0, 0.0], atol=2e-3)
