"""The command protocol, the ground station's side: send, repeat until acknowledged, and say how it ended.

A PX4 executes every copy of a repeated command, so only commands are sent whose repetition changes nothing.
"""

import math
from dataclasses import dataclass, field

from gcs.dialect import Message, enum_name, mavlink
from gcs.errors import CommandRefused, LinkLost
from gcs.microservices import Backoff, Microservice
from missions.frames import GeodeticPoint
from missions.mission_items import DEG_E7

FIRST_TIMEOUT_S = 0.5
ATTEMPTS = 16
PROGRESS_TIMEOUT_S = 30.0
"""Patience once the other side has said that it is at work."""

NAN = math.nan

ONE_BY_ONE = frozenset({mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAV_CMD_REQUEST_MESSAGE})
"""Their acknowledgements do not say which message was meant."""
MAKING_SAFE = frozenset({mavlink.MAV_CMD_DO_SET_MODE, mavlink.MAV_CMD_NAV_LAND, mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH})
"""Sent also where a second vehicle with the same system id is heard: to the one that was there first."""
MOVING = MAKING_SAFE | {mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_DO_REPOSITION}
"""Of these the last one that was given counts."""


@dataclass(frozen=True)
class Command:
    """One COMMAND_LONG: its number, parameters 1 to 7, and what an operator calls it."""

    name: str
    number: int
    params: tuple[float, ...] = ()

    def message(self, peer: tuple[int, int], confirmation: int) -> Message:
        params = (*self.params, *(0.0,) * (7 - len(self.params)))
        return mavlink.MAVLink_command_long_message(*peer, self.number, confirmation, *params)


@dataclass(frozen=True)
class PlaceCommand(Command):
    """One COMMAND_INT: parameters 1 to 4, and a place that a float32 could not carry; its altitude is AMSL."""

    place: GeodeticPoint | None = None

    def message(self, peer: tuple[int, int], confirmation: int) -> Message:
        assert self.place is not None
        one, two, three, four = (*self.params, *(0.0,) * (4 - len(self.params)))
        x, y = round(self.place.latitude_deg * DEG_E7), round(self.place.longitude_deg * DEG_E7)
        frame, z_m = mavlink.MAV_FRAME_GLOBAL, self.place.altitude_amsl_m
        system, component = peer
        return mavlink.MAVLink_command_int_message(
            system, component, frame, self.number, 0, 0, one, two, three, four, x, y, z_m
        )


@dataclass
class CommandClient(Microservice):
    """One command to one component.

    Raises:
        CommandRefused: the other side answered anything but ACCEPTED.
        LinkLost: it did not answer at all.
    """

    command: Command
    peer: tuple[int, int]
    done: bool = False
    deadline_s: float = math.inf
    wants: frozenset[str] = frozenset({"COMMAND_ACK"})
    _confirmation: int = 0
    _backoff: Backoff = field(default_factory=lambda: Backoff(FIRST_TIMEOUT_S, ATTEMPTS))

    def __post_init__(self) -> None:
        number = self.command.number
        self.turn = f"command {number}" if number in ONE_BY_ONE else None
        self.makes_safe = number in MAKING_SAFE

    def start(self, now_s: float) -> list[Message]:
        self.deadline_s = now_s + self._backoff.take()
        return [self.command.message(self.peer, self._confirmation)]

    def receive(self, message: Message, now_s: float) -> list[Message]:
        if message.command != self.command.number or self.done:
            return []
        if message.result == mavlink.MAV_RESULT_IN_PROGRESS:
            self.deadline_s = now_s + PROGRESS_TIMEOUT_S
            return []
        self.done = True
        if message.result != mavlink.MAV_RESULT_ACCEPTED:
            result = enum_name("MAV_RESULT", message.result).removeprefix("MAV_RESULT_")
            raise CommandRefused(f"{self}: {result}")
        return []

    def handle_timeout(self, now_s: float) -> list[Message]:
        if self._backoff.exhausted:
            self.done = True
            raise LinkLost(f"{self}: no answer to {self._confirmation + 1} requests")
        self._confirmation = min(self._confirmation + 1, 255)
        return self.start(now_s)

    def replaced_by(self, newer: Microservice) -> Exception | None:
        """A newer order of the same kind must not be undone by a late repetition of the older one."""
        if not isinstance(newer, CommandClient) or self.turn is not None or newer.peer != self.peer:
            return None
        same_kind = newer.command.number == self.command.number or {newer.command.number, self.command.number} <= MOVING
        if not same_kind or newer.command == self.command:
            return None
        return CommandRefused(f"{self}: replaced by a newer order, {newer.command.name}")

    def __str__(self) -> str:
        return f"vehicle {self.peer[0]}: {self.command.name}"
