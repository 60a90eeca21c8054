"""A companion's end of the fleet link: bytes in, bytes out, once a tick. Sans-IO: ports are handed in."""

from collections.abc import Callable, Iterable, Iterator
from typing import Protocol

import numpy as np

from companion.events import AutopilotLost, Event, LandedReported, Odometry, UtcReported
from companion.fleet.exchange import Exchange
from companion.fleet.neighbour import POSITION_ERROR_M
from companion.fleet.reports import PositionReport, Report
from missions.frames import AutopilotFrame
from missions.mission import Mission

MOST_AT_ONCE = 512
"""Datagrams of one tick: whoever floods the link does not hold up the setpoints."""


class Frames(Protocol):
    """Reports as bytes, and back."""

    def pack(self, report: Report) -> bytes | None: ...

    def read(self, datagram: bytes) -> Iterator[Report]: ...


class FleetDesk:
    """Hears the others, and speaks for this vehicle.

    Args:
        exchange: what is heard, and what is to be said.
        mission: for what is told of the error of positions.
        frames: bytes to reports and back.
        poll: the datagrams that have come in.
        send: to everybody.
    """

    def __init__(
        self,
        exchange: Exchange,
        mission: Mission,
        frames: Frames,
        poll: Callable[[], Iterable[bytes]],
        send: Callable[[bytes], None],
    ) -> None:
        self.exchange = exchange
        self._error_m = POSITION_ERROR_M[mission.site]
        self._frames = frames
        self._poll = poll
        self._send = send
        self._odometry: Odometry | None = None
        self._on_ground = True

    def notice(self, event: Event) -> None:
        """What a vehicle reports, as far as others want to know it."""
        match event:
            case Odometry():
                self._odometry = event
            case LandedReported(on_ground):
                self._on_ground = on_ground
            case UtcReported(ahead_s):
                self.exchange.utc_ahead_s = ahead_s
            case AutopilotLost():
                self._odometry = self.exchange.utc_ahead_s = None
            case _:
                pass

    def listen(self, now_s: float) -> None:
        """Take in what has arrived."""
        for count, datagram in enumerate(self._poll(), start=1):
            for report in self._frames.read(datagram):
                self.exchange.hear(report, now_s)
            if count == MOST_AT_ONCE:
                break

    def speak(self, frame: AutopilotFrame | None, now_s: float) -> None:
        """Say what is due; positions once it is known where the autopilot's frame lies."""
        place = self._place(frame) if self.exchange.is_position_due(now_s) else None
        for report in self.exchange.tick(place, now_s):
            datagram = self._frames.pack(report)
            if datagram is not None:
                self._send(datagram)

    def _place(self, frame: AutopilotFrame | None) -> PositionReport | None:
        odometry, ahead_s = self._odometry, self.exchange.utc_ahead_s
        if odometry is None or frame is None:
            return None
        ends_ned_m = np.array([odometry.position_m, odometry.position_m + odometry.velocity_m_s])
        if not np.all(np.isfinite(ends_ned_m)):
            return None
        here_m, after_a_second_m = frame.enu(ends_ned_m)
        return PositionReport(
            sysid=self.exchange.sysid,
            utc_s=None if ahead_s is None else odometry.time_s + ahead_s,
            position_m=here_m,
            velocity_m_s=after_a_second_m - here_m,
            error_m=self._error_m,
            on_ground=self._on_ground,
        )
