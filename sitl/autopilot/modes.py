"""PX4's flight modes, and how HEARTBEAT and CURRENT_MODE show them."""

from dataclasses import dataclass
from enum import Enum, IntEnum

MANUAL_INPUT, STABILIZE, GUIDED, AUTO, CUSTOM = 64, 16, 8, 4, 1
"""Bits of MAV_MODE_FLAG."""
SAFETY_ARMED = 128


class MainMode(IntEnum):
    """The second highest byte of custom_mode."""

    MANUAL = 1
    ALTITUDE = 2
    POSITION = 3
    AUTO = 4
    ACRO = 5
    OFFBOARD = 6
    STABILIZED = 7
    TERMINATION = 10


@dataclass(frozen=True)
class ModeTraits:
    """What distinguishes a mode on the wire and for arming."""

    label: str
    """As PX4's texts call it."""
    main: MainMode
    sub: int = 0
    base_mode: int = CUSTOM | AUTO | GUIDED | STABILIZE
    standard_mode: int = 0
    """MAV_STANDARD_MODE."""
    needs_sticks: bool = False
    allows_arming: bool = True
    needs_position: bool = True
    """False: it can be flown by a vehicle that does not know where it is, at least for a while."""


_STICKS = CUSTOM | MANUAL_INPUT | STABILIZE


class Mode(Enum):
    """A flight mode."""

    MANUAL = ModeTraits("Manual", MainMode.MANUAL, base_mode=_STICKS, needs_sticks=True, needs_position=False)
    ALTITUDE = ModeTraits(
        "Altitude", MainMode.ALTITUDE, base_mode=_STICKS, standard_mode=4, needs_sticks=True, needs_position=False
    )
    POSITION = ModeTraits("Position", MainMode.POSITION, base_mode=_STICKS, standard_mode=1, needs_sticks=True)
    POSITION_SLOW = ModeTraits("Position Slow", MainMode.POSITION, 2, base_mode=_STICKS, needs_sticks=True)
    ORBIT = ModeTraits(
        "Orbit", MainMode.POSITION, 1, base_mode=CUSTOM | STABILIZE, standard_mode=2, allows_arming=False
    )
    ACRO = ModeTraits("Acro", MainMode.ACRO, base_mode=CUSTOM | MANUAL_INPUT, needs_sticks=True, needs_position=False)
    STABILIZED = ModeTraits(
        "Stabilized", MainMode.STABILIZED, base_mode=_STICKS, needs_sticks=True, needs_position=False
    )
    OFFBOARD = ModeTraits("Offboard", MainMode.OFFBOARD, base_mode=CUSTOM | STABILIZE, needs_position=False)
    TAKEOFF = ModeTraits("Takeoff", MainMode.AUTO, 2, standard_mode=8)
    HOLD = ModeTraits("Hold", MainMode.AUTO, 3)
    MISSION = ModeTraits("Mission", MainMode.AUTO, 4, standard_mode=6)
    RTL = ModeTraits("Return", MainMode.AUTO, 5, standard_mode=5, allows_arming=False)
    LAND = ModeTraits("Land", MainMode.AUTO, 6, standard_mode=7, allows_arming=False, needs_position=False)
    FOLLOW = ModeTraits("Follow Target", MainMode.AUTO, 8, base_mode=CUSTOM | STABILIZE, allows_arming=False)
    TERMINATION = ModeTraits(
        "Termination", MainMode.TERMINATION, base_mode=CUSTOM, allows_arming=False, needs_position=False
    )

    @property
    def custom_mode(self) -> int:
        return self.value.sub << 24 | self.value.main << 16

    @property
    def is_auto(self) -> bool:
        """Whether the autopilot itself decides where to fly."""
        return self.value.main is MainMode.AUTO or self is Mode.ORBIT

    @property
    def label(self) -> str:
        return self.value.label


def mode_of(main: int, sub: int) -> Mode | None:
    """The mode that a pilot selects by these numbers, if this autopilot has it; without a sub mode, Auto is Mission."""
    if main == MainMode.POSITION:
        return Mode.POSITION_SLOW if sub == Mode.POSITION_SLOW.value.sub else Mode.POSITION
    if main == MainMode.AUTO:
        wanted = sub or Mode.MISSION.value.sub
        return next((mode for mode in Mode if mode.value.main == main and mode.value.sub == wanted), None)
    return next((mode for mode in Mode if mode.value.main == main), None)


def mode_of_flags(base_mode: int) -> Mode | None:
    """The mode that MAV_MODE_FLAGs alone ask for, as programs do that know nothing of PX4; None for no flag."""
    if base_mode & AUTO:
        return Mode.MISSION
    if not base_mode & MANUAL_INPUT:
        return None
    if base_mode & GUIDED:
        return Mode.POSITION
    return Mode.STABILIZED if base_mode & STABILIZE else Mode.MANUAL
