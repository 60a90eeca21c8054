"""Texts for the pilot: on the ground link only, kept while no ground station listens, long ones in chunks."""

from collections import deque

from sitl.autopilot.reports import Severity
from sitl.dialect import mavlink
from sitl.microservices.outbox import Link, Outbox

CHUNK_BYTES = 50
KEPT_TEXTS = 16


class StatusTexts:
    """STATUSTEXT of one vehicle."""

    def __init__(self, outbox: Outbox) -> None:
        self._outbox = outbox
        self._waiting: deque[tuple[Severity, str]] = deque(maxlen=KEPT_TEXTS)
        self._id = 0
        self.listener = True
        """Whether a ground station listens; set to False when its heartbeats stop."""

    def say(self, severity: Severity, text: str) -> None:
        """Keep a text for the next flush. PX4 ends texts that come as events as well in a tab; so do we."""
        self._waiting.append((severity, f"{text}\t"))

    def flush(self) -> None:
        """Send what has been kept, if there is a listener."""
        while self.listener and self._waiting:
            self._send(*self._waiting.popleft())

    def _send(self, severity: Severity, text: str) -> None:
        self._id = self._id % 0xFFFF + 1
        raw = text.encode()
        chunks = [raw[i : i + CHUNK_BYTES] for i in range(0, len(raw), CHUNK_BYTES)]
        number = self._id if len(chunks) > 1 else 0
        for seq, chunk in enumerate(chunks):
            message = mavlink.MAVLink_statustext_message(severity, chunk, number, seq)
            self._outbox.send(Link.GROUND, message)
