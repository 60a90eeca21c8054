"""What a vehicle keeps while its autopilot is off."""

from dataclasses import dataclass, field

from sitl.autopilot.plan import Plan


@dataclass
class Charge:
    """The charge of a battery, as a share of a full one."""

    remaining: float = 1.0
    most: float = 1.0
    """What it is charged to; less for a battery that has failed."""

    def limit(self, remaining: float) -> None:
        """The battery has this much left, and is never charged to more."""
        self.remaining = self.most = remaining


@dataclass
class SigningMemory:
    """The key of the ground link, and what has been signed with it."""

    key: bytes | None = None
    """32 bytes; None does not sign."""
    timestamp: int = 0
    """The highest one that was sent or accepted."""
    streams: dict[tuple[int, int, int], int] = field(default_factory=dict[tuple[int, int, int], int])
    """(system, component, link id) -> the last timestamp that was accepted."""


@dataclass
class Memory:
    """What PX4 has on its SD card, and the battery; the autopilot reads it at boot and writes it at every change."""

    parameters: dict[str, float | int] = field(default_factory=dict[str, float | int])
    """Those that have been set."""
    mission: Plan = field(default_factory=Plan)
    fence: Plan = field(default_factory=Plan)
    rally: Plan = field(default_factory=Plan)
    charge: Charge = field(default_factory=Charge)
    signing: SigningMemory = field(default_factory=SigningMemory)
