"""From vehicle time to the clock that vehicles share: trajectories are announced in UTC."""

from collections.abc import Iterator
from dataclasses import replace

import msgspec

from companion.instructions import Instruction, SendTrajectory


class UtcClock:
    """How far UTC is ahead of vehicle time."""

    def __init__(self) -> None:
        self.ahead_s: float | None = None
        """None until the autopilot has said so."""

    def stamped(self, instructions: Iterator[Instruction]) -> Iterator[Instruction]:
        """The same instructions, announced trajectories in UTC; before that is known, they are not announced."""
        for instruction in instructions:
            if not isinstance(instruction, SendTrajectory):
                yield instruction
            elif self.ahead_s is not None:
                message, trajectory = instruction.message, instruction.message.trajectory
                in_utc = replace(trajectory, start_s=trajectory.start_s + self.ahead_s)
                yield SendTrajectory(msgspec.structs.replace(message, trajectory=in_utc))
