"""What an operator chooses for one flight."""

from enum import Enum
from pathlib import Path

import msgspec

from gcs.folders import key_folder
from gcs.link.url import LinkUrl, Scheme
from missions.faults import Fault, SimulatorFault
from missions.frames import GeodeticPoint
from missions.mission import SensorKind


class PlanningMode(Enum):
    """Who plans the flight; comparing the three is the paper's claim."""

    END_CLOUD = "end-cloud"
    """Cloud track points, flown by the companions, which plan locally."""
    CLOUD = "cloud"
    """The autopilot flies the cloud's mission; no companion."""
    ONBOARD = "onboard"
    """The companions plan everything; the mission holds the target alone."""

    @property
    def needs_companions(self) -> bool:
        return self is not PlanningMode.CLOUD


class Autopilots(Enum):
    """Where the autopilots come from, and so which programs the ground station starts."""

    SIMULATED = "simulated"
    """The simulator and one companion per vehicle."""
    COMPANIONS = "companions"
    """The companions; the autopilots are there already."""
    ATTACHED = "attached"
    """Nothing: everything is running."""


class OriginHere(Enum):
    """The wish to move the mission to where the vehicles stand."""

    HERE = "here"


class FlightSettings(msgspec.Struct, frozen=True, kw_only=True):
    """One `gcs fly`, as the command line states it."""

    mission: str
    mode: PlanningMode = PlanningMode.END_CLOUD
    autopilots: Autopilots = Autopilots.ATTACHED
    headless: bool = False
    speed: float = 1.0
    seed: int = 0
    links: tuple[LinkUrl, ...] = ()
    origin: GeodeticPoint | OriginHere | None = None
    report_dir: Path | None = None
    host: str = "127.0.0.1"
    port: int = 8080
    faults: tuple[Fault, ...] = ()
    """Of the companions."""
    simulator_faults: tuple[SimulatorFault, ...] = ()
    """Beside those of the mission."""
    instance_base: int = 0
    keys: Path | None = None
    """Folder of the signing keys; None for the usual one."""
    sensor: SensorKind = SensorKind.LIDAR
    """Of the companions that are started."""
    lidar_host: str = "127.0.0.1"
    """Where the companions that are started hear their lidars."""

    @property
    def simulated(self) -> bool:
        return self.autopilots is Autopilots.SIMULATED

    @property
    def starts_companions(self) -> bool:
        return self.mode.needs_companions and self.autopilots is not Autopilots.ATTACHED

    @property
    def simulates_lidar(self) -> bool:
        """The simulated vehicles carry range sensors: somebody looks."""
        return self.mode.needs_companions and self.sensor is not SensorKind.NONE

    def ground_links(self) -> tuple[LinkUrl, ...]:
        """The links that were asked for, or the usual port on loopback."""
        return self.links or (LinkUrl(Scheme.UDP_IN, "127.0.0.1", 14550 + self.instance_base),)

    def key_folder(self) -> Path:
        """The ring of keys: that which was named, or the usual one; simulated vehicles have one of their own."""
        if self.keys is not None:
            return self.keys
        if self.autopilots is not Autopilots.SIMULATED:
            return key_folder("vehicles")
        return key_folder(f"sim-{self.instance_base}" if self.instance_base else "sim")
