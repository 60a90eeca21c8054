"""Forwarding between a vehicle's two links, by PX4's rules: this is how the ground station reaches the companion.

Messages without a target, and those for everybody, go to the other link. A targeted message goes there if its target
has been heard there. What is for the autopilot alone, comes from its own id, or is unknown, stays.
"""

from sitl.dialect import Message
from sitl.microservices.outbox import AUTOPILOT_COMPID, Link, Sender

MOST_HEARD = 256
"""Of the systems and components that speak on a link, this many are remembered: those that were heard last."""


class Router:
    """Who has been heard on which link.

    Args:
        sysid: the vehicle's own.
    """

    def __init__(self, sysid: int) -> None:
        self._sysid = sysid
        self._heard: dict[Link, dict[tuple[int, int], None]] = {link: {} for link in Link}

    def forwards(self, message: Message, sender: Sender) -> bool:
        """Take note of the sender; whether the message goes on to the other link."""
        if sender.sysid == self._sysid and sender.compid == AUTOPILOT_COMPID:
            return False
        self._remember(sender)
        if message.get_type() == "SETUP_SIGNING":  # a key goes to whom it is for, and nowhere else
            return False
        target = getattr(message, "target_system", 0)
        component = getattr(message, "target_component", 0)
        if message.get_type() == "MANUAL_CONTROL":  # its receiver has another name
            target = message.target
        if target == 0:
            return True
        if target == self._sysid and component == AUTOPILOT_COMPID:
            return False
        there = self._heard[sender.link.other]
        if component == 0:
            return any(sysid == target for sysid, _ in there)
        return (target, component) in there

    def _remember(self, sender: Sender) -> None:
        heard, who = self._heard[sender.link], (sender.sysid, sender.compid)
        heard.pop(who, None)
        heard[who] = None
        if len(heard) > MOST_HEARD:
            del heard[next(iter(heard))]

    def is_for_autopilot(self, message: Message) -> bool:
        """Whether the autopilot itself is meant, alone or among others; nobody obeys a command to everybody."""
        target = getattr(message, "target_system", 0)
        component = getattr(message, "target_component", 0)
        everybody = target == 0 and not message.get_type().startswith("COMMAND")
        return (everybody or target == self._sysid) and component in (0, AUTOPILOT_COMPID)
