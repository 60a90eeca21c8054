"""The programs of one flight: the simulator and the companions, started with the flight's options, and ended."""

import asyncio
from contextlib import AsyncExitStack
from dataclasses import dataclass
from pathlib import Path

from gcs.flight.events import EventLog
from gcs.processes import Child, Processes
from gcs.settings import FlightSettings, PlanningMode
from missions import lidar_packets, ports
from missions.faults import format_fault
from missions.mission import Mission, SensorKind

TRUTH_FILE = "truth.csv"


@dataclass
class FlightPrograms:
    """What runs beside the ground station for one mission.

    Args:
        settings: what the operator chose on the command line.
        source: the mission's path or shipped name, as the programs read it.
        events: the log.
        log_dir: where the programs' output and the simulator's truth go.
        keys_path: the simulated vehicles' signing keys.
    """

    settings: FlightSettings
    source: str
    events: EventLog
    log_dir: Path
    keys_path: Path

    def __post_init__(self) -> None:
        self._simulator, self._companions = AsyncExitStack(), AsyncExitStack()
        self.watches: list[asyncio.Task[None]] = []
        """Tasks of others that watch these programs: cancelled before the programs are ended."""

    @property
    def truth_path(self) -> Path:
        return self.log_dir / TRUTH_FILE

    async def start_simulator(self, mission: Mission, mode: PlanningMode) -> tuple[Processes, Child]:
        """Start the simulator; whoever watches it is returned what to watch."""
        settings = self.settings
        self.events.add("process", "starting the simulator; on a fresh machine it is compiled first, in a minute")
        options = ["--seed", str(settings.seed), "--truth", str(self.truth_path)]
        options += ["--signing-key", str(self.keys_path)]
        for fault in settings.simulator_faults:
            options += ["--fault", format_fault(fault)]
        options.append("--lidar" if settings.simulates_lidar_in(mode) else "--no-lidar")
        processes = await self._simulator.enter_async_context(Processes(self.log_dir))
        return processes, await processes.start("sitl", "sitl", self.source, *options, *self._common_options(mission))

    async def start_companions(self, mission: Mission, mode: PlanningMode) -> tuple[Processes, list[Child]]:
        """Start one companion per vehicle."""
        processes = await self._companions.enter_async_context(Processes(self.log_dir))
        number = len(mission.vehicles)
        self.events.add("process", f"starting {number} companions; on a fresh machine they, too, are compiled first")
        children: list[Child] = []
        for vehicle in mission.vehicles:
            name = f"companion-{vehicle.sysid}"
            options = ["--vehicle", str(vehicle.sysid), "--mission", self.source]
            options += ["--mode", mode.value, "--seed", str(self.settings.seed)]
            options += ["--log", str(self.log_dir / f"{name}.jsonl")]
            options += self._sensor_options(vehicle.sysid) + self._fleet_options()
            for fault in self.settings.faults:
                if fault.vehicle == vehicle.sysid:
                    options += ["--fault", format_fault(fault)]
            children.append(await processes.start(name, "companion", *options, *self._common_options(mission)))
        return processes, children

    async def end(self) -> None:
        """End them all: companions first, they need the autopilots to leave their vehicles in a chosen state."""
        for watch in self.watches:
            watch.cancel()
        await asyncio.gather(*self.watches, return_exceptions=True)
        await self._companions.aclose()
        await self._simulator.aclose()

    def _sensor_options(self, sysid: int) -> list[str]:
        """What a companion sees with, and where it hears it."""
        settings = self.settings
        port = lidar_packets.FIRST_PORT + sysid - 1 + settings.instance_base
        address = ["--lidar", f"{settings.lidar_host}:{port}"] if settings.sensor is SensorKind.LIDAR else []
        return ["--sensor", settings.sensor.value, *address]

    def _fleet_options(self) -> list[str]:
        """How companions of this machine hear each other where no simulator passes their words on."""
        if self.settings.simulated:
            return []
        port = ports.FIRST_FLEET_PORT + self.settings.instance_base
        return ["--fleet-link", f"mcast://{ports.FLEET_GROUP}:{port}/127.0.0.1"]

    def _common_options(self, mission: Mission) -> list[str]:
        origin = mission.origin
        place = f"{origin.latitude_deg!r},{origin.longitude_deg!r},{origin.altitude_amsl_m!r}"
        shared = ["--speed", f"{self.settings.speed:g}", "--instance-base", str(self.settings.instance_base)]
        return [*shared, "--origin", place, "--supervised"]
