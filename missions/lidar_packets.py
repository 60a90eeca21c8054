"""The lidar's datagrams, laid out as a Livox Mid-360 sends its point cloud: Cartesian coordinates, in millimetres.

Little-endian; a header of 36 bytes, then 14 bytes a point. Points are relative to the vehicle's centre, FLU (forward,
left, up), the time is that of the vehicle's clock. Only what was hit is sent. The decoder takes bytes from outside:
whatever is wrong with them is a `LidarPacketError`, nothing else.
"""

import struct
import zlib
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from missions.errors import MissionError

Array = npt.NDArray[np.float64]

FIRST_PORT = 56300
"""Where the first vehicle's companion hears its lidar; the others' follow."""
POINTS_PER_PACKET = 96
"""As the device: a datagram stays below an Ethernet frame."""
MOUNT_FLU_M = np.array([0.0, 0.0, 0.1])
"""Where the device sits on a vehicle, and is told to sit: the origin of its rays, from the vehicle's centre."""
CARTESIAN_MM = 1
"""The header's data_type."""
_HEADER = struct.Struct("<BHHHHBBB12xIQ")
_CRC_FROM = 28
"""The CRC-32 covers everything behind itself: time and points."""
_CRC = struct.Struct("<I")
_CRC_AT = 24
_POINT = np.dtype([("mm", "<i4", 3), ("reflectivity", "u1"), ("tag", "u1")])
REFLECTIVITY = 128


class LidarPacketError(MissionError):
    """Bytes that are no packet of a lidar."""


@dataclass(frozen=True)
class LidarPacket:
    """Some of the points of one scan."""

    time_s: float
    """Of the vehicle's clock, when the scan was taken."""
    frame: int
    """Scan that it is from, modulo 256."""
    number: int
    """Of the packet, in all packets, modulo 65536: gaps are losses."""
    points_flu_m: Array
    """(n, 3) from the vehicle's centre."""


def pack(packet: LidarPacket) -> bytes:
    """One datagram.

    Raises:
        LidarPacketError: more points than fit.
    """
    count = len(packet.points_flu_m)
    if count > POINTS_PER_PACKET:
        raise LidarPacketError(f"lidar packet: expected at most {POINTS_PER_PACKET} points, found {count}")
    points = np.zeros(count, dtype=_POINT)
    points["mm"] = np.round(packet.points_flu_m * 1e3)
    points["reflectivity"] = REFLECTIVITY
    length, frame, number = _HEADER.size + points.nbytes, packet.frame & 0xFF, packet.number & 0xFFFF
    header = _HEADER.pack(0, length, 0, count, number, frame, CARTESIAN_MM, 0, 0, round(packet.time_s * 1e9))
    whole = header + points.tobytes()
    return whole[:_CRC_AT] + _CRC.pack(zlib.crc32(whole[_CRC_FROM:])) + whole[_CRC_FROM:]


def unpack(datagram: bytes) -> LidarPacket:
    """The points in a datagram.

    Raises:
        LidarPacketError: it is not a whole packet of Cartesian points.
    """
    if len(datagram) < _HEADER.size:
        raise LidarPacketError(f"lidar packet: expected {_HEADER.size} bytes or more, found {len(datagram)}")
    version, length, _, count, number, frame, kind, _, crc, time_ns = _HEADER.unpack_from(datagram)
    expected = _HEADER.size + count * _POINT.itemsize
    if not len(datagram) == length == expected:
        raise LidarPacketError(f"lidar packet: expected {expected} bytes for {count} points, found {len(datagram)}")
    if (version, kind) != (0, CARTESIAN_MM):
        raise LidarPacketError(f"lidar packet: expected version 0, data type 1, found {version} and {kind}")
    if crc != zlib.crc32(datagram[_CRC_FROM:]):
        raise LidarPacketError("lidar packet: the checksum is wrong")
    points = np.frombuffer(datagram, dtype=_POINT, offset=_HEADER.size)["mm"] * 1e-3
    return LidarPacket(time_s=time_ns * 1e-9, frame=frame, number=number, points_flu_m=points)
