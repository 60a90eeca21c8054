"""The lidar's driver: datagrams in, whole scans out. Sans-IO.

Datagrams come from outside: late, twice, in another order, not at all, or from somebody who means harm. Each of these
is counted and dropped, and what is kept in the meantime is bounded.
"""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from companion.sensing.intake import Dropped, is_current
from companion.sensing.pose_history import PoseHistory
from companion.sensing.scan import Scan
from missions.frames import AutopilotFrame, swap_enu_ned
from missions.lidar_packets import MOUNT_FLU_M, LidarPacket, LidarPacketError, unpack

Array = npt.NDArray[np.float64]

MOST_PACKETS = 512
"""Of one scan; a Mid-360 sends 208 in 0.1 s."""
QUIET_S = 0.01
"""Vehicle time without a packet after which a scan is whole; a packet of the next one says so at once."""
BEYOND_RANGE = 1.1
"""Points farther off than this, in ranges of the sensor, are errors."""


@dataclass
class _Gathering:
    """The packets of one scan so far."""

    frame: int
    newest_s: float = float("-inf")
    """The latest stamp among its packets."""
    heard_s: float = 0.0
    """Vehicle time when its last packet came in."""
    packets: dict[int, LidarPacket] = field(default_factory=dict[int, LidarPacket])
    """By number."""


class LidarDriver:
    """Gathers packets into scans.

    Args:
        range_m: of the sensor.
        body_radius_m: what is nearer than this is the vehicle itself.
    """

    def __init__(self, range_m: float, body_radius_m: float) -> None:
        self._range_m, self._body_radius_m = range_m, body_radius_m
        self._gathering: _Gathering | None = None
        self._whole: _Gathering | None = None
        self._closed_s = float("-inf")  # nothing stamped up to here is waited for any more
        self._next_number: int | None = None
        self.heard_s = float("-inf")
        """Vehicle time at which the last good packet came in."""
        self.lost = 0
        """Packets that never came, by their numbers."""
        self.dropped: Counter[Dropped] = Counter()

    def receive(self, raw: bytes, now_s: float) -> None:
        """Take in one datagram at vehicle time `now_s`; never raises."""
        try:
            packet = unpack(raw)
        except LidarPacketError:
            self.dropped[Dropped.MALFORMED] += 1
            return
        if not is_current(packet.time_s, now_s):
            self.dropped[Dropped.CLOCK] += 1
            return
        if (gathering := self._gathering_of(packet)) is None:
            self.dropped[Dropped.LATE] += 1
        elif packet.number in gathering.packets:
            self.dropped[Dropped.TWICE] += 1
        elif len(gathering.packets) >= MOST_PACKETS:
            self.dropped[Dropped.TOO_MANY] += 1
        else:
            gathering.packets[packet.number] = packet
            gathering.newest_s = max(gathering.newest_s, packet.time_s)
            gathering.heard_s = self.heard_s = now_s
            self._count_losses(packet.number)

    def take(self, poses: PoseHistory, frame: AutopilotFrame, now_s: float) -> Scan | None:
        """The scan that has become whole since the last call, if there is one and the poses reach so far."""
        if self._gathering is not None and now_s - self._gathering.heard_s >= QUIET_S:
            self._finish()
        if (whole := self._whole) is None:
            return None
        if not is_current(whole.newest_s, now_s):
            self.dropped[Dropped.NO_POSE] += 1
            self._whole = None
        elif poses.newest_s >= whole.newest_s:
            self._whole = None
            return self._scan_of(whole, poses, frame)
        return None

    def forget(self) -> None:
        """The vehicle's clock has jumped: what was stamped before says nothing about now."""
        self._gathering = self._whole = self._next_number = None
        self._closed_s = self.heard_s = float("-inf")

    def _gathering_of(self, packet: LidarPacket) -> _Gathering | None:
        """Where a packet belongs: to the scan that is gathered, to a new one, or nowhere since it comes too late."""
        gathering = self._gathering
        if gathering is not None and packet.frame == gathering.frame:
            return gathering
        if packet.time_s <= max(self._closed_s, gathering.newest_s if gathering is not None else self._closed_s):
            return None
        self._finish()
        self._gathering = _Gathering(packet.frame)
        return self._gathering

    def _finish(self) -> None:
        """No more packets are waited for."""
        if self._gathering is not None:
            if self._whole is not None:
                self.dropped[Dropped.OVERTAKEN] += 1
            self._whole, self._gathering = self._gathering, None
            self._closed_s = self._whole.newest_s

    def _count_losses(self, number: int) -> None:
        """Numbers count up modulo 65536; a gap is a loss until the missing packet comes after all."""
        ahead = 0 if self._next_number is None else (number - self._next_number) & 0xFFFF
        if ahead < MOST_PACKETS:
            self.lost += ahead
            self._next_number = number + 1 & 0xFFFF
        elif ahead >= 0x10000 - MOST_PACKETS:
            self.lost = max(self.lost - 1, 0)
        else:  # the device has been restarted
            self._next_number = number + 1 & 0xFFFF

    def _scan_of(self, whole: _Gathering, poses: PoseHistory, frame: AutopilotFrame) -> Scan | None:
        """The points of all packets, each placed by the pose at its own time; None when there is no pose for one."""
        by_time: dict[float, list[Array]] = {}
        for packet in whole.packets.values():
            by_time.setdefault(packet.time_s, []).append(packet.points_flu_m)
        at = {time_s: poses.at(time_s) for time_s in by_time}
        if (last := at[whole.newest_s]) is None or None in at.values():
            self.dropped[Dropped.NO_POSE] += 1
            return None
        placed = [
            self._within_range(np.concatenate(by_time[time_s])) @ pose.flu_to_enu
            + swap_enu_ned(pose.position_ned_m - last.position_ned_m)
            for time_s, pose in at.items()
            if pose is not None
        ]
        here_enu_m = frame.enu(last.position_ned_m)
        sensor_enu_m = here_enu_m + MOUNT_FLU_M @ last.flu_to_enu
        return Scan(whole.newest_s, sensor_enu_m, np.concatenate(placed) + here_enu_m, self._range_m)

    def _within_range(self, points_flu_m: Array) -> Array:
        """Without what is the vehicle itself, and what the sensor cannot see."""
        away_m = np.sqrt(np.einsum("ij,ij->i", points_flu_m, points_flu_m))
        return points_flu_m[(away_m > self._body_radius_m) & (away_m < BEYOND_RANGE * self._range_m)]
