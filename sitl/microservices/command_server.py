"""COMMAND_LONG, COMMAND_INT and SET_MODE: executed once, however often they are sent, and acknowledged."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.reports import Result, Say
from sitl.dialect import Message, mavlink
from sitl.microservices.outbox import Link, Outbox, Sender
from sitl.microservices.streams import Streams
from sitl.microservices.telemetry import Moment

REPEATED_WITHIN_S = 5.0
"""Wall clock: a copy of a command with confirmation > 0 that comes this soon after the last copy is the same order."""


MOST_REMEMBERED = 64
"""Of the commands that might be repeated, the last ones."""


@dataclass(frozen=True)
class Command:
    """A command, whichever message it came in."""

    number: int
    params: tuple[float, float, float, float, float, float, float]
    """Of COMMAND_INT too: 5 and 6 are degrees where they are a place."""

    @property
    def place(self) -> tuple[float, float]:
        """Latitude and longitude [deg]; NaN for none."""
        return self.params[4], self.params[5]


@dataclass
class _Last:
    command: Command
    result: Result | None
    time_s: float


Handler = Callable[["CommandServer", Command, Sender], Result | None]
"""Executes a command; None is answered with silence."""


class CommandServer:
    """Executes commands and acknowledges them.

    Args:
        autopilot: who executes.
        outbox: where answers go.
        streams: of each link, for message requests.
        moment: what messages are made of, now.
        say: where complaints go.
        speed: simulated seconds per wall-clock second.
        handlers: command number -> who executes it.
    """

    def __init__(
        self,
        autopilot: Autopilot,
        outbox: Outbox,
        streams: dict[Link, Streams],
        moment: Callable[[], Moment],
        say: Say,
        speed: float,
        handlers: Mapping[int, Handler],
    ) -> None:
        self.autopilot = autopilot
        self.outbox = outbox
        self.streams = streams
        self.moment = moment
        self.say = say
        self._repeated_within_s = REPEATED_WITHIN_S * speed
        self._handlers = handlers
        self._last: dict[tuple[Sender, int], _Last] = {}

    def receive_long(self, message: Message, sender: Sender, now_s: float) -> None:
        m = message
        params = (m.param1, m.param2, m.param3, m.param4, m.param5, m.param6, m.param7)
        self._receive(Command(m.command, params), m.confirmation, sender, now_s)

    def receive_int(self, message: Message, sender: Sender, now_s: float) -> None:
        m = message
        x = math.nan if m.x == 2**31 - 1 else m.x * 1e-7
        y = math.nan if m.y == 2**31 - 1 else m.y * 1e-7
        self._receive(Command(m.command, (m.param1, m.param2, m.param3, m.param4, x, y, m.z)), 0, sender, now_s)

    def receive_set_mode(self, message: Message, sender: Sender, now_s: float) -> None:
        """SET_MODE, the old message: answered as if it were DO_SET_MODE."""
        main, sub = message.custom_mode >> 16 & 0xFF, message.custom_mode >> 24 & 0xFF
        params = (float(message.base_mode), float(main), float(sub), 0.0, 0.0, 0.0, 0.0)
        self._receive(Command(mavlink.MAV_CMD_DO_SET_MODE, params), 0, sender, now_s)

    def acknowledge(self, number: int, result: int, sender: Sender) -> None:
        ack = mavlink.MAVLink_command_ack_message(number, result, 0, 0, sender.sysid, sender.compid)
        self.outbox.send(sender.link, ack)

    def _receive(self, command: Command, confirmation: int, sender: Sender, now_s: float) -> None:
        key = (sender, command.number)
        last = self._last.get(key)
        fresh = last is not None and now_s - last.time_s <= self._repeated_within_s
        if last is not None and fresh and confirmation > 0 and _is_same(last.command, command):
            result, last.time_s = last.result, now_s
        else:
            result = self._execute(command, sender)
            self._remember(key, _Last(command, result, now_s))
        if result is not None:
            self.acknowledge(command.number, result, sender)

    def _remember(self, key: tuple[Sender, int], last: _Last) -> None:
        self._last.pop(key, None)
        self._last[key] = last
        if len(self._last) > MOST_REMEMBERED:
            del self._last[next(iter(self._last))]

    def _execute(self, command: Command, sender: Sender) -> Result | None:
        if any(math.isinf(param) for param in command.params):
            return Result.DENIED
        handler = self._handlers.get(command.number)
        return handler(self, command, sender) if handler is not None else Result.UNSUPPORTED


def _is_same(one: Command, other: Command) -> bool:
    """Equal, where NaN equals NaN."""
    pairs = zip(one.params, other.params, strict=True)
    return one.number == other.number and all(a == b or (a != a and b != b) for a, b in pairs)
