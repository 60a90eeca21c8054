"""How a MISSION_START is answered; docs/companion.md has the table."""

from dataclasses import dataclass

from companion.instructions import CommandResult
from missions.tunnel import Reason

FINAL = {Reason.NO_MISSION, Reason.MISSION_NOT_UNDERSTOOD}
"""What will not change by waiting."""


@dataclass(frozen=True)
class Situation:
    """What a pilot knows when it is told to start.

    Args:
        stopping: the program is about to end.
        obeyed: it engages, lands, or is in control already.
        missing: what keeps it from being ready.
        airborne: armed, and off the ground.
        just_released: somebody else has taken control a moment ago.
    """

    stopping: bool
    obeyed: bool
    missing: Reason
    airborne: bool
    just_released: bool


def answer(situation: Situation) -> tuple[CommandResult, Reason]:
    """Result and reason of the acknowledgement; the first that applies."""
    if situation.stopping:
        return CommandResult.DENIED, Reason.STOPPED_BY_OPERATOR
    if situation.obeyed:
        return CommandResult.ACCEPTED, Reason.NONE
    if (missing := situation.missing) is not Reason.NONE:
        return (CommandResult.DENIED if missing in FINAL else CommandResult.TEMPORARILY_REJECTED), missing
    if not situation.airborne:
        return CommandResult.TEMPORARILY_REJECTED, Reason.NOT_AIRBORNE
    if situation.just_released:
        return CommandResult.TEMPORARILY_REJECTED, Reason.CONTROL_TAKEN
    return CommandResult.ACCEPTED, Reason.NONE
