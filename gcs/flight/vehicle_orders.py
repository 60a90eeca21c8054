"""What one vehicle of a flight can be ordered to do, from arming to landing, and what its monitor has to know of it."""

import numpy as np
import numpy.typing as npt

from gcs.dialect import AUTOPILOT, COMPANION, Mode
from gcs.errors import GcsError
from gcs.fleet.vehicle_state import VehicleState
from gcs.flight import actions
from gcs.flight.events import Severity
from gcs.flight.monitor import Phase
from gcs.flight.operation import Operation
from gcs.flight.vehicle_flight import VehicleFlight
from gcs.microservices.command_client import Command, CommandClient
from missions.mission import Site

Array = npt.NDArray[np.float64]

TAKEOFF_TIMEOUT_S = 60.0
"""In vehicle time."""


class VehicleOrders(Operation):
    """Orders to the vehicles of one flight; each raises a GcsError when it is refused or not answered."""

    async def arm(self, flight: VehicleFlight) -> None:
        """Arm; the autopilot disarms again when no take-off follows soon."""
        await self.command(flight, actions.arm())

    async def take_off(self, flight: VehicleFlight) -> None:
        """Climb to the hover height above its pad."""
        flight.monitor.phase = Phase.TAKING_OFF
        altitude_m = self._hover_height_m(flight) + self.mission.origin.altitude_amsl_m + flight.monitor.ground_offset_m
        await self.command(flight, actions.take_off(altitude_m))

    async def hover(self, flight: VehicleFlight) -> None:
        """Wait until it hovers after its take-off."""
        state, height_m = self._state(flight), self._hover_height_m(flight)
        tolerance_m = 0.3 if self.mission.site is Site.INDOOR else 1.5

        def hovering() -> bool:
            position_m = state.position_m(self.mission.frame, flight.monitor.ground_offset_m)
            return (
                position_m is not None
                and abs(position_m[2] - height_m) < tolerance_m
                and abs(state.velocity_enu_m_s[2]) < 0.3
                and state.mode is Mode.HOLD
            )

        timeout_s = TAKEOFF_TIMEOUT_S / self.speed
        await self.station.wait_until(hovering, timeout_s, f"{flight.name} does not hover at {height_m:g} m")
        flight.monitor.phase = Phase.HOVERING
        self.events.add("hovering", f"hovering at {height_m:g} m", flight.name)

    async def start(self, flight: VehicleFlight) -> None:
        """Start the mission, or go on with it."""
        component = COMPANION if self.mode.needs_companions else AUTOPILOT
        await self._command_to(flight.sysid, component, actions.start_mission())
        flight.monitor.start(self._state(flight), self.station.now_s)
        self.events.add("started", "mission started", flight.name)

    async def hold(self, flight: VehicleFlight) -> None:
        """Stop where it is, on the operator's order."""
        flight.monitor.pause(self._state(flight), self.station.now_s)
        await self.command(flight, actions.set_mode(Mode.HOLD))

    async def go_to(self, flight: VehicleFlight, place_m: Array) -> None:
        """Fly straight to a (3,) ENU place and hold there, on the operator's order."""
        flight.monitor.pause(self._state(flight), self.station.now_s)
        place = self.mission.frame.geodetic(place_m + np.array([0.0, 0.0, flight.monitor.ground_offset_m]))
        await self.command(flight, actions.go_to(place))

    async def change_speed(self, flight: VehicleFlight, speed_m_s: float) -> None:
        """Fly at another speed from now on."""
        await self.command(flight, actions.change_speed(speed_m_s))

    async def land(self, flight: VehicleFlight, reason: str = "landed by the operator") -> None:
        """Come down on the spot."""
        flight.monitor.come_down(reason)
        await self.command(flight, actions.set_mode(Mode.LAND))

    async def return_home(self, flight: VehicleFlight, reason: str = "sent home by the operator") -> None:
        """Return to the pad and land there."""
        flight.monitor.come_down(reason)
        await self.command(flight, actions.set_mode(Mode.RTL))

    async def kill(self, flight: VehicleFlight) -> None:
        """Stop the motors at once, wherever it is."""
        flight.monitor.come_down("motors stopped by the operator")
        await self.command(flight, actions.kill())

    async def break_off(self, flight: VehicleFlight, reason: str) -> None:
        """End a flight that has hardly begun: land what flies, disarm what stands."""
        state = self._state(flight)
        order = actions.set_mode(Mode.LAND) if state.airborne else actions.disarm()
        if state.armed or flight.monitor.phase.in_flight:
            try:
                await self.command(flight, order)
            except GcsError as problem:
                self.events.add("refused", str(problem), flight.name, Severity.ERROR)
        flight.monitor.give_up(f"take-off broken off: {reason}")

    async def command(self, flight: VehicleFlight, command: Command) -> None:
        """Give a command to a vehicle's autopilot, and tell the log."""
        self.events.add("command", command.name, flight.name)
        await self._command_to(flight.sysid, AUTOPILOT, command)

    async def _command_to(self, sysid: int, component: int, command: Command) -> None:
        await self.station.run(CommandClient(command, (sysid, component)))

    def _state(self, flight: VehicleFlight) -> VehicleState:
        return self.station.vehicle(flight.sysid)

    def _hover_height_m(self, flight: VehicleFlight) -> float:
        return flight.vehicle.pad_m[2] + self.mission.takeoff_height_m
