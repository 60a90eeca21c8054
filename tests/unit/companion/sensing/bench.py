"""A vehicle on a bench whose sensors see a wall: its frame, its poses, and a lidar's datagrams."""

import math

import numpy as np

from companion.sensing.pose_history import PoseHistory
from missions.frames import AutopilotFrame
from missions.lidar_packets import LidarPacket, pack
from missions.mission import load_mission

INDOOR = load_mission("indoor")
FRAME = AutopilotFrame(INDOOR.origin, INDOOR.frame)
LEVEL_NORTH = np.array([1.0, 0.0, 0.0, 0.0])
NOW_S = 50.0


def turned(axis_frd: tuple[float, float, float], angle_deg: float) -> np.ndarray:
    """An attitude: level and northward, then turned about an axis of the body."""
    half = math.radians(angle_deg) / 2.0
    return np.concatenate(([math.cos(half)], math.sin(half) * np.array(axis_frd)))


def poses(place_enu_m=(5.0, 6.0, 1.5), velocity_enu_m_s=(0.0, 0.0, 0.0), attitude=LEVEL_NORTH) -> PoseHistory:
    """Two seconds of flying straight on, until 0.1 s after now; at `place_enu_m` now."""
    history = PoseHistory()
    for time_s in np.arange(NOW_S - 2.0, NOW_S + 0.1, 1.0 / 30.0).tolist():
        place = np.array(place_enu_m) + (time_s - NOW_S) * np.array(velocity_enu_m_s)
        history.add(time_s, FRAME.ned(place), attitude)
    return history


def datagram(number: int, points=((2.0, 0.0, 0.0),), frame: int = 7, time_s: float = NOW_S) -> bytes:
    return pack(LidarPacket(time_s, frame, number, np.array(points, dtype=float).reshape(-1, 3)))
