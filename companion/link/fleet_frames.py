"""The fleet link's messages as MAVLink 2 frames: TUNNEL for plans, UTM_GLOBAL_POSITION for places. No socket.

Frames come from outside: whatever cannot be read is counted and dropped.
"""

from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

from companion.fleet.reports import PlanReport, PositionReport, Report
from missions.errors import WireFormatError
from missions.frames import LocalFrame
from missions.tunnel import MAX_PAYLOAD_BYTES, PayloadType, decode_trajectory, encode_trajectory

COMPANION = 191
MAVLINK_2 = 0xFD
LARGEST_DATAGRAM_BYTES = 4096
NO_PLACE = 2_000_000_000
"""No latitude or longitude is so large."""
UPDATE_RATE_CS = 25
TIME_VALID, POSITION_AVAILABLE, ALTITUDE_AVAILABLE, HEIGHT_AVAILABLE, HORIZONTAL, VERTICAL = 1, 4, 8, 16, 32, 64
PLACE_NEEDED = POSITION_AVAILABLE | ALTITUDE_AVAILABLE


class FleetFrames:
    """Writes this vehicle's frames and reads the others'.

    Args:
        sysid: of this vehicle.
        frame: the mission's.
    """

    def __init__(self, sysid: int, frame: LocalFrame) -> None:
        self._frame = frame
        self._writer = mavlink.MAVLink(None, sysid, COMPANION)
        self._reader: Any = mavlink.MAVLink(None)
        self._reader.robust_parsing = True
        self.dropped: Counter[str] = Counter()
        """What could not be read, or said, by reason."""

    def pack(self, report: Report) -> bytes | None:
        """One frame; None for a plan that does not fit into one, which is counted."""
        if isinstance(report, PositionReport):
            return self._utm_global_position(report).pack(self._writer)
        try:
            payload = encode_trajectory(report.message)
        except ValueError:
            self.dropped["too large to be told"] += 1
            return None
        padded = list(payload.ljust(MAX_PAYLOAD_BYTES, b"\0"))
        kind = int(PayloadType.TRAJECTORY)
        return mavlink.MAVLink_tunnel_message(0, 0, kind, len(payload), padded).pack(self._writer)

    def read(self, datagram: bytes) -> Iterator[Report]:
        """The reports in a datagram."""
        if len(datagram) > LARGEST_DATAGRAM_BYTES or datagram[:1] != bytes([MAVLINK_2]):
            self.dropped["no frame"] += 1
            return
        messages: list[Any] = self._reader.parse_buffer(bytearray(datagram)) or []
        if self._reader.buf_len():  # a frame that its datagram cut off must not eat the next one
            self.dropped["no frame"] += 1
            self._reader.buf, self._reader.buf_index = bytearray(), 0
        for message in messages:
            report = self._read_one(message)
            if report is not None:
                yield report

    def _read_one(self, message: Any) -> Report | None:
        kind = message.get_type()
        if kind == "UTM_GLOBAL_POSITION":
            return self._position(message)
        if kind == "TUNNEL" and message.payload_type == PayloadType.TRAJECTORY:
            return self._plan(message)
        self.dropped["no frame" if kind == "BAD_DATA" else "not for the fleet"] += 1
        return None

    def _plan(self, message: Any) -> PlanReport | None:
        payload = bytes(message.payload)
        try:
            if message.payload_length > len(payload) or message.get_srcComponent() != COMPANION:
                raise WireFormatError("no payload of a companion")
            return PlanReport(message.get_srcSystem(), decode_trajectory(payload[: message.payload_length]))
        except WireFormatError:
            self.dropped["no plan"] += 1
            return None

    def _position(self, message: Any) -> PositionReport | None:
        flags = message.flags
        if flags & PLACE_NEEDED != PLACE_NEEDED or abs(message.lat) > NO_PLACE // 2 or abs(message.lon) > NO_PLACE:
            self.dropped["no position"] += 1
            return None
        place = self._frame.enu(message.lat / 1e7, message.lon / 1e7, message.alt / 1e3)
        north_m_s, east_m_s, down_m_s = message.vx / 100.0, message.vy / 100.0, message.vz / 100.0
        moves_m_s = np.array([east_m_s, north_m_s, -down_m_s])
        moves_m_s[:2] *= bool(flags & HORIZONTAL)
        moves_m_s[2] *= bool(flags & VERTICAL)
        return PositionReport(
            sysid=message.get_srcSystem(),
            utc_s=message.time / 1e6 if flags & TIME_VALID else None,
            position_m=np.asarray(place, dtype=float).reshape(3),
            velocity_m_s=moves_m_s,
            error_m=max(message.h_acc, message.v_acc) / 1e3,
            on_ground=message.flight_state == mavlink.UTM_FLIGHT_STATE_GROUND,
        )

    def _utm_global_position(self, report: PositionReport) -> Any:
        place = self._frame.geodetic(report.position_m)
        east_m_s, north_m_s, up_m_s = report.velocity_m_s.tolist()
        on_ground = mavlink.UTM_FLIGHT_STATE_GROUND, mavlink.UTM_FLIGHT_STATE_AIRBORNE
        known = PLACE_NEEDED | HEIGHT_AVAILABLE | HORIZONTAL | VERTICAL
        error_mm = min(round(report.error_m * 1e3), 0xFFFF)
        return mavlink.MAVLink_utm_global_position_message(
            round((report.utc_s or 0.0) * 1e6),
            [0] * 18,
            round(place.latitude_deg * 1e7),
            round(place.longitude_deg * 1e7),
            round(place.altitude_amsl_m * 1e3),
            round(report.position_m[2] * 1e3),
            _centimetres(north_m_s),
            _centimetres(east_m_s),
            _centimetres(-up_m_s),
            error_mm,
            error_mm,
            0,
            0,
            0,
            0,
            UPDATE_RATE_CS,
            on_ground[0] if report.on_ground else on_ground[1],
            known | (TIME_VALID if report.utc_s is not None else 0),
        )


def _centimetres(value_m_s: float) -> int:
    return min(max(round(value_m_s * 100.0), -32768), 32767)
