"""MISSION_CURRENT at once when it changes, and MISSION_ITEM_REACHED, which PX4 repeats for ten seconds."""

from sitl.dialect import mavlink
from sitl.microservices.outbox import Link, Outbox
from sitl.microservices.streams import Streams
from sitl.microservices.telemetry import Moment, mission_current
from sitl.wire import FieldValues

REPEATS = 10
REPEAT_S = 1.0


class MissionProgress:
    """How far the mission has got, told to both links."""

    def __init__(self, outbox: Outbox) -> None:
        self._outbox = outbox
        self._shown: FieldValues | None = None
        self._reached = 0
        self._repeats_left = 0
        self._repeat_s = 0.0

    def reached(self, seq: int) -> None:
        """An item has been reached."""
        self._reached, self._repeats_left = seq, REPEATS
        self._outbox.send_to_all(mavlink.MAVLink_mission_item_reached_message(seq))
        self._repeat_s = 0.0

    def tick(self, moment: Moment, streams: dict[Link, Streams]) -> None:
        """Tell changes, repeat what has been reached."""
        current = mission_current(moment)
        if current != self._shown:
            self._shown = current
            for stream in streams.values():
                stream.send_now("MISSION_CURRENT", moment)
        if self._repeats_left == 0:
            return
        if self._repeat_s == 0.0:
            self._repeat_s = moment.now_s + REPEAT_S
        elif moment.now_s >= self._repeat_s:
            self._repeat_s = moment.now_s + REPEAT_S
            self._repeats_left -= 1
            self._outbox.send_to_all(mavlink.MAVLink_mission_item_reached_message(self._reached))
