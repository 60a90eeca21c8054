"""Links, who is at their other end, and where services put what they want to send."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from sitl.dialect import Message
from sitl.wire import FieldValues, FrameWriter, Layout

AUTOPILOT_COMPID = 1


class Link(Enum):
    """The two links of a vehicle."""

    GROUND = "ground"
    ONBOARD = "onboard"

    @property
    def other(self) -> "Link":
        return Link.ONBOARD if self is Link.GROUND else Link.GROUND


@dataclass(frozen=True)
class Sender:
    """Who sent a message, and over which link it came."""

    link: Link
    sysid: int
    compid: int


class Outbox:
    """Frames that wait to be sent, in order; each link counts its own sequence.

    Args:
        sysid: the vehicle's system id.
    """

    def __init__(self, sysid: int) -> None:
        self._writers = {link: FrameWriter(sysid, AUTOPILOT_COMPID) for link in Link}
        self._frames: list[tuple[Link, bytes]] = []

    def send(self, link: Link, message: Message) -> None:
        """One pymavlink message to one link."""
        self._frames.append((link, self._writers[link].encode(message)))

    def send_to_all(self, message: Message) -> None:
        for link in Link:
            self.send(link, message)

    def sender_of_values(self, link: Link) -> Callable[[Layout, FieldValues], None]:
        """`send_values` for one link, for who has much to send."""
        writer = self._writers[link]

        def send(layout: Layout, values: FieldValues) -> None:
            self._frames.append((link, writer.frame(layout, values)))

        return send

    def send_values(self, link: Link, layout: Layout, values: FieldValues) -> None:
        """One message as its values in documented order: the quick way, for streams."""
        self._frames.append((link, self._writers[link].frame(layout, values)))

    def send_payload(self, link: Link, layout: Layout, payload: bytes) -> None:
        """One message as its payload in wire order."""
        self._frames.append((link, self._writers[link].wrap(layout, payload)))

    def forward(self, link: Link, frame: bytes) -> None:
        """Somebody else's frame, as it is."""
        self._frames.append((link, frame))

    def take(self) -> list[tuple[Link, bytes]]:
        """All frames since the last call."""
        frames, self._frames = self._frames, []
        return frames
