"""All vehicles by system id."""

from dataclasses import dataclass, field

from gcs.dialect import GCS_SYSTEM, Message, mavlink
from gcs.fleet.vehicle_state import VehicleState

MAX_VEHICLES = 250


@dataclass
class Fleet:
    """The vehicles that were heard; a vehicle exists from its autopilot's first heartbeat on."""

    vehicles: dict[int, VehicleState] = field(default_factory=dict)

    def fold(self, message: Message, now_s: float) -> None:
        """Take in one message from any system."""
        sysid = message.get_srcSystem()
        vehicle = self.vehicles.get(sysid)
        if vehicle is None:
            if not _is_autopilot(message) or sysid in {0, GCS_SYSTEM} or len(self.vehicles) >= MAX_VEHICLES:
                return
            vehicle = self.vehicles[sysid] = VehicleState(sysid)
        vehicle.fold(message, now_s)


def _is_autopilot(message: Message) -> bool:
    return message.get_type() == "HEARTBEAT" and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID
