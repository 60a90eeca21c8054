"""Which item of its mission a vehicle is to fly: MISSION_SET_CURRENT, confirmed by MISSION_CURRENT.

A mission that is swapped in flight without it has an item that is current by accident.
"""

import math
from dataclasses import dataclass, field

from gcs.dialect import Message, mavlink
from gcs.errors import LinkLost
from gcs.microservices import Backoff, Microservice

FIRST_TIMEOUT_S = 0.4
ATTEMPTS = 12


@dataclass
class CurrentItem(Microservice):
    """Set the current item and see it set.

    Args:
        peer: system and component.
        seq: the item.
        mission_id: what the vehicle calls the mission that is meant; 0 if it has no name for it.

    Raises:
        LinkLost: the vehicle does not say that the item is current.
    """

    peer: tuple[int, int]
    seq: int
    mission_id: int = 0
    done: bool = False
    deadline_s: float = math.inf
    wants: frozenset[str] = frozenset({"MISSION_CURRENT"})
    _backoff: Backoff = field(default_factory=lambda: Backoff(FIRST_TIMEOUT_S, ATTEMPTS, 1.5))

    def start(self, now_s: float) -> list[Message]:
        self.deadline_s = now_s + self._backoff.take()
        return [mavlink.MAVLink_mission_set_current_message(*self.peer, self.seq)]

    def receive(self, message: Message, now_s: float) -> list[Message]:
        """Before any mission id is known to be ours, the item's number alone has to do."""
        if not self.mission_id or not message.mission_id:
            self.done = message.seq == self.seq
        else:  # a companion may have gone on to a later item already
            self.done = message.mission_id == self.mission_id and message.seq >= self.seq
        return []

    def handle_timeout(self, now_s: float) -> list[Message]:
        if self._backoff.exhausted:
            self.done = True
            raise LinkLost(f"vehicle {self.peer[0]}: does not say that item {self.seq} is its current one")
        return self.start(now_s)
