"""What a pilot wants done: the one door out. Instructions are data; the program's shell carries them out."""

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

from companion.events import FlightMode, Sender
from companion.planner.planner import PlanRequest
from companion.setpoints import Setpoint
from missions.tunnel import CompanionStatus, Reason, TrajectoryMessage


class CommandResult(IntEnum):
    """MAV_RESULT, as far as a companion answers with it."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2


@dataclass(frozen=True)
class SendSetpoint:
    """Stream this; the link repeats it until another one comes."""

    setpoint: Setpoint


@dataclass(frozen=True)
class EndSetpoints:
    """Stop the stream of setpoints, without commanding a mode."""


@dataclass(frozen=True)
class CommandMode:
    """Command a mode; `ModeCommandEnded` comes back."""

    mode: FlightMode


@dataclass(frozen=True)
class AcknowledgeStart:
    """Answer a MISSION_START."""

    sender: Sender
    result: CommandResult
    reason: Reason = Reason.NONE


@dataclass(frozen=True)
class RequestPlan:
    """Plan beside the setpoint stream; `PlanReady` comes back."""

    request: PlanRequest


@dataclass(frozen=True)
class DownloadMission:
    """Fetch the stored mission; `MissionDownloaded` comes back with the same identity."""

    identity: int


@dataclass(frozen=True)
class SetCurrentItem:
    """Tell the autopilot which mission item is flown to (progress)."""

    seq: int


@dataclass(frozen=True)
class SendStatus:
    """Broadcast the companion's status."""

    status: CompanionStatus


@dataclass(frozen=True)
class SendTrajectory:
    """Broadcast a trajectory."""

    message: TrajectoryMessage


@dataclass(frozen=True)
class Note:
    """Write a decision into the log."""

    text: str
    fields: dict[str, Any] = field(default_factory=dict[str, Any])


Instruction = (
    SendSetpoint
    | EndSetpoints
    | CommandMode
    | AcknowledgeStart
    | RequestPlan
    | DownloadMission
    | SetCurrentItem
    | SendStatus
    | SendTrajectory
    | Note
)
