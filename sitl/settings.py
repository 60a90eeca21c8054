"""How a simulation is run."""

from dataclasses import dataclass
from pathlib import Path

from missions.faults import SimulatorFault
from missions.lidar_packets import FIRST_PORT
from missions.ports import FIRST_ONBOARD_PORT, companion_port
from sitl.dynamics.airframe import AirframeName

GROUND_PORT, GCS_PORT = 18570, 14550
ONBOARD_PORT = FIRST_ONBOARD_PORT
CONTROL_PORT = 14990
"""Where faults are ordered at run time."""
HIGHEST_INSTANCE_BASE = 65535 - GROUND_PORT - 250
HIGHEST_INSTANCE_BASE_WITH_LIDAR = 65535 - FIRST_PORT - 250
HIGHEST_ONBOARD_PORT = GROUND_PORT - 250
"""As far as any instance base leaves room for 250 vehicles."""


@dataclass(frozen=True)
class Settings:
    """What the command line says."""

    speed: float = 1.0
    """Simulated seconds per wall-clock second; fewer when the CPU cannot keep up."""
    seed: int = 1
    truth: Path | None = None
    """CSV file for where the vehicles really are."""
    instance_base: int = 0
    """Added to all ports."""
    airframe: AirframeName = AirframeName.X500_LIKE
    onboard_port: int = ONBOARD_PORT
    """Of the first vehicle's onboard link; the others' follow."""
    first_companion_port: int | None = None
    """Of the first vehicle's companion, if the others' shall follow it; the usual ones for None."""
    faults: tuple[SimulatorFault, ...] = ()
    """Beside those of the mission."""
    signing_key: Path | None = None
    """File with the keys of the ground links."""
    parameters: Path | None = None
    """Folder in which parameters outlast the simulation."""
    lidar: bool = False
    """Whether the companions get the packets of the mission's range sensor."""
    supervised: bool = False
    """End when standard input does."""
    host: str = "127.0.0.1"

    def companion_port(self, sysid: int) -> int:
        """Where a vehicle's companion is, before the shift by `instance_base`."""
        first = self.first_companion_port
        return companion_port(sysid) if first is None else first + sysid - 1
