"""Who is there: heartbeats of the ground station and the companion, and the texts when they stop."""

import math

from sitl.autopilot.parameters import Parameters
from sitl.autopilot.reports import Say, Severity
from sitl.dialect import Message, mavlink

SILENT_S = 2.5
"""A ground station that has been silent for this long (wall clock) is not sent texts."""


class Peers:
    """The ends of a vehicle's links, as their HEARTBEATs show them.

    Args:
        parameters: for COM_DL_LOSS_T and COM_OBC_LOSS_T.
        say: where the texts go.
        speed: simulated seconds per wall-clock second.
    """

    def __init__(self, parameters: Parameters, say: Say, speed: float) -> None:
        self._parameters = parameters
        self._say = say
        self._silent_s = SILENT_S * speed
        self._gcs_s = -math.inf
        self._companion_s = -math.inf
        self._gcs_was_lost = self._companion_was_lost = True
        self._gcs_seen_before = False

    def receive_heartbeat(self, message: Message, now_s: float) -> None:
        if message.type == mavlink.MAV_TYPE_GCS:
            self._gcs_s = now_s
        elif message.type == mavlink.MAV_TYPE_ONBOARD_CONTROLLER:
            self._companion_s = now_s

    def gcs_lost(self, now_s: float) -> bool:
        return now_s - self._gcs_s > self._parameters["COM_DL_LOSS_T"]

    def gcs_listens(self, now_s: float) -> bool:
        """False from when heartbeats that have been heard stop; true also before the first one."""
        return self._gcs_s == -math.inf or now_s - self._gcs_s < self._silent_s

    def update(self, now_s: float) -> None:
        """Say who has gone or come back."""
        lost = self.gcs_lost(now_s)
        if lost and not self._gcs_was_lost:
            self._say(Severity.INFO, "Connection to ground station lost")
        elif self._gcs_was_lost and not lost and self._gcs_seen_before:
            self._say(Severity.INFO, "GCS connection regained")
        self._gcs_seen_before = self._gcs_seen_before or not lost
        self._gcs_was_lost = lost
        companion_lost = now_s - self._companion_s > self._parameters["COM_OBC_LOSS_T"]
        if companion_lost and not self._companion_was_lost:
            self._say(Severity.CRITICAL, "Connection to mission computer lost")
        self._companion_was_lost = companion_lost
