"""What the companion needs from a vehicle: events in, actions out.

`companion.link.px4` is the one for real autopilots (and the SITL over UDP); tests have others. Nothing above this
interface knows MAVSDK, sockets or threads.
"""

from typing import Protocol

from companion.events import Event, FlightMode, Sender
from companion.instructions import CommandResult
from companion.setpoints import Setpoint
from missions.mission_items import MissionItem
from missions.tunnel import PayloadType, Reason


class Autopilot(Protocol):
    """One vehicle. Coroutines may take as long as a link takes; everything else returns at once."""

    async def open(self) -> None:
        """Begin to listen.

        Raises:
            UsageError: the connection cannot be opened, such as a port in use.
        """
        ...

    async def receive(self) -> Event:
        """The next thing that the vehicle, or a ground station through it, has to say."""
        ...

    def send_setpoint(self, setpoint: Setpoint) -> None:
        """Stream a setpoint; the link may repeat it until the next one."""
        ...

    def end_setpoints(self) -> None:
        """End the stream, without commanding a mode."""
        ...

    async def command_mode(self, mode: FlightMode) -> None:
        """Command a mode.

        Raises:
            CommandRefused: the autopilot refused, or did not answer.
        """
        ...

    async def download_mission(self) -> tuple[MissionItem, ...]:
        """The mission that the autopilot has stored.

        Raises:
            CommandRefused: it could not be downloaded.
        """
        ...

    async def set_current_item(self, seq: int) -> None:
        """Make a mission item the current one.

        Raises:
            CommandRefused: the autopilot refused, or did not answer.
        """
        ...

    def acknowledge_start(self, sender: Sender, result: CommandResult, reason: Reason) -> None:
        """Answer a MISSION_START with a COMMAND_ACK, the reason in its result_param2."""
        ...

    def send_tunnel(self, kind: PayloadType, payload: bytes) -> None:
        """Broadcast a TUNNEL message (target 0/0)."""
        ...

    def close(self) -> None:
        """End all threads and sockets; the stream of setpoints ends, too."""
        ...
