"""TIMESYNC and PING: requests are answered at once."""

from sitl.dialect import Message, mavlink
from sitl.microservices.outbox import Outbox, Sender


class ClockServer:
    """Answers about the vehicle's clock, which counts from boot."""

    def __init__(self, outbox: Outbox) -> None:
        self._outbox = outbox

    def receive_timesync(self, message: Message, sender: Sender, now_s: float) -> None:
        """A request has tc1 = 0; answers to our own requests need no action."""
        if message.tc1 == 0:
            answer = mavlink.MAVLink_timesync_message(round(now_s * 1e9), message.ts1)
            self._outbox.send(sender.link, answer)

    def receive_ping(self, message: Message, sender: Sender, now_s: float) -> None:
        """A request has no target; the answer has."""
        if message.target_system == 0 and message.target_component == 0:
            answer = mavlink.MAVLink_ping_message(message.time_usec, message.seq, sender.sysid, sender.compid)
            self._outbox.send(sender.link, answer)
