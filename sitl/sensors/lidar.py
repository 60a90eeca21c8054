"""The companion's range sensor, a lidar or a depth camera: what it sees of the true world, with its errors.

A grid of rays fills the field of view, turned by a random part of a cell from scan to scan, so that scans do not
repeat. All rays of a scan are taken at one moment. The sensor looks forward from a little above the vehicle's centre;
it sees what is mapped and what is not, movers, other vehicles and the ground, but no threats. Points are relative to
the centre: such devices are told where they are mounted, and take it into account.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from missions import lidar_packets, obstacles
from missions.frames import swap_enu_ned
from missions.lidar_packets import MOUNT_FLU_M, POINTS_PER_PACKET, LidarPacket
from missions.mission import Mission, RangeSensor
from sitl.sensors.ray_casting import cast_rays

Array = npt.NDArray[np.float64]

SECTORS = 72
SECTOR_RAD = 2.0 * math.pi / SECTORS
LEVEL_RAD = math.radians(10.0)
"""Rays this near to the plane of the body count for the distances around."""


@dataclass(frozen=True)
class Scan:
    """What one vehicle has seen at one moment."""

    time_s: float
    """Of the vehicle's clock."""
    points_flu_m: Array
    """(n, 3) hits from the vehicle's centre: forward, left, up."""
    distances_m: tuple[float, ...]
    """To the nearest hit in 72 sectors of 5 degrees, clockwise from ahead; infinite for none, NaN for unseen."""


class RangeSensors:
    """The sensors of a fleet, all at one rate.

    Args:
        mission: the world and the sensor.
        rng: of noise, dropouts and the turn of the grid.
    """

    def __init__(self, mission: Mission, rng: np.random.Generator) -> None:
        self._sensor = mission.sensor
        self._rng = rng
        self._world = obstacles.pack(mission.world, with_threats=False)
        self._movers = mission.world.movers
        self._body_radius_m = mission.limits.body_radius_m
        self._seen_sectors = seen_sectors(mission.sensor)
        self._latest = -1

    def is_due(self, time_s: float) -> bool:
        """Whether it is time for the next scan."""
        return time_s * self._sensor.rate_hz >= self._latest + 1 - 1e-6

    def scan(self, time_s: float, positions_enu_m: Array, attitudes_ned_frd: Array, clocks_s: Array) -> list[Scan]:
        """One scan of every vehicle.

        Args:
            time_s: simulated time, for the movers.
            positions_enu_m: (n, 3) true positions.
            attitudes_ned_frd: (n, 4) true attitudes, body FRD -> NED.
            clocks_s: (n,) the vehicles' own time.
        """
        self._latest = math.floor(time_s * self._sensor.rate_hz + 1e-6)
        movers = [(*mover.position(time_s), mover.radius_m) for mover in self._movers]
        vehicles = [(*position, self._body_radius_m) for position in positions_enu_m]
        scans: list[Scan] = []
        for index, (position, attitude) in enumerate(zip(positions_enu_m, attitudes_ned_frd, strict=True)):
            balls = movers + vehicles[:index] + vehicles[index + 1 :]
            scans.append(self._scan_one(position, attitude, np.array(balls).reshape(-1, 4), float(clocks_s[index])))
        return scans

    def _scan_one(self, position_enu_m: Array, attitude: Array, balls: Array, clock_s: float) -> Scan:
        sensor, rng = self._sensor, self._rng
        directions = ray_grid(sensor, rng.random(2))
        rays = np.ascontiguousarray(flu_to_enu(directions, attitude))
        eye = position_enu_m + flu_to_enu(MOUNT_FLU_M[None], attitude)[0]
        distances = cast_rays(eye, rays, self._world, balls, sensor.range_m)
        distances += sensor.noise_m * rng.standard_normal(len(distances))
        kept = np.isfinite(distances) & (distances > 0.0) & (rng.random(len(distances)) >= sensor.dropout)
        points = directions[kept] * distances[kept, None] + MOUNT_FLU_M
        return Scan(clock_s, points, self._around(directions[kept], distances[kept]))

    def _around(self, directions_flu: Array, distances_m: Array) -> tuple[float, ...]:
        nearest = np.where(self._seen_sectors, np.inf, np.nan)
        level = np.abs(directions_flu[:, 2]) <= math.sin(LEVEL_RAD)
        rays, across = directions_flu[level], distances_m[level] * np.hypot(*directions_flu[level, :2].T)
        sectors = np.round(np.arctan2(-rays[:, 1], rays[:, 0]) / SECTOR_RAD).astype(int) % SECTORS
        np.fmin.at(nearest, sectors, across)
        return tuple(nearest.tolist())


def ray_grid(sensor: RangeSensor, turn: Array) -> Array:
    """(n, 3) unit vectors FLU that fill the field of view, the grid shifted by `turn` in [0, 1)^2 cells."""
    horizontal, vertical = math.radians(sensor.horizontal_deg), math.radians(sensor.vertical_deg)
    columns, rows = (math.ceil(angle / math.radians(sensor.spacing_deg)) for angle in (horizontal, vertical))
    azimuth = horizontal * ((np.arange(columns) + turn[0]) / columns - 0.5)
    elevation = vertical * ((np.arange(rows) + turn[1]) / rows - 0.5)
    level, ahead = np.cos(elevation)[:, None], np.stack([np.cos(azimuth), np.sin(azimuth)])
    rays = np.empty((rows, columns, 3))
    rays[..., 0], rays[..., 1], rays[..., 2] = level * ahead[0], level * ahead[1], np.sin(elevation)[:, None]
    return rays.reshape(-1, 3)


def seen_sectors(sensor: RangeSensor) -> npt.NDArray[np.bool_]:
    """(72,) which of the sectors around have their middle in the field of view."""
    angles = np.arange(SECTORS) * SECTOR_RAD
    off_axis = np.minimum(angles, 2.0 * math.pi - angles)
    return off_axis <= 0.5 * math.radians(sensor.horizontal_deg) + 1e-9


def flu_to_enu(vectors_flu: Array, attitude_ned_frd: Array) -> Array:
    """(n, 3) vectors of the sensor's frame in ENU, by the unit quaternion w, x, y, z of the body."""
    w, x, y, z = attitude_ned_frd.tolist()
    forward = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)  # in NED
    left = 2.0 * (w * z - x * y), 2.0 * (x * x + z * z) - 1.0, -2.0 * (y * z + w * x)
    up = -2.0 * (x * z + w * y), 2.0 * (w * x - y * z), 2.0 * (x * x + y * y) - 1.0
    ned = [
        f * vectors_flu[:, 0] + r * vectors_flu[:, 1] + u * vectors_flu[:, 2]
        for f, r, u in zip(forward, left, up, strict=True)
    ]
    return swap_enu_ned(np.column_stack(ned))


class PacketStream:
    """One vehicle's scans as datagrams, numbered."""

    def __init__(self) -> None:
        self._number = self._frame = 0

    def datagrams(self, scan: Scan) -> list[bytes]:
        """The datagrams of a scan; one without points if nothing was hit, so that silence means a dead sensor."""
        points = scan.points_flu_m
        out: list[bytes] = []
        for begin in range(0, max(len(points), 1), POINTS_PER_PACKET):
            part = points[begin : begin + POINTS_PER_PACKET]
            out.append(lidar_packets.pack(LidarPacket(scan.time_s, self._frame, self._number, part)))
            self._number += 1
        self._frame += 1
        return out
