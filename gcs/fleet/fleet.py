"""All vehicles by system id."""

from dataclasses import dataclass, field

from gcs.dialect import COMPANION, GCS_SYSTEM, Message, mavlink
from gcs.fleet.vehicle_state import VehicleState
from gcs.mapping.observed_map import ObservedMap
from missions.errors import WireFormatError
from missions.occupancy import decode_block
from missions.tunnel import PayloadType

MAX_VEHICLES = 254
"""As many as there are system ids besides ours."""


@dataclass
class Fleet:
    """The vehicles that were heard; a vehicle exists from its autopilot's first heartbeat on."""

    vehicles: dict[int, VehicleState] = field(default_factory=dict[int, VehicleState])
    observed: ObservedMap = field(default_factory=ObservedMap)
    """What their companions have seen."""

    def fold(self, message: Message, now_s: float) -> None:
        """Take in one message from any system."""
        sysid = message.get_srcSystem()
        vehicle = self.vehicles.get(sysid)
        if vehicle is None:
            if not _is_autopilot(message) or sysid in {0, GCS_SYSTEM} or len(self.vehicles) >= MAX_VEHICLES:
                return
            vehicle = self.vehicles[sysid] = VehicleState(sysid)
        vehicle.fold(message, now_s)
        if _is_occupancy(message):
            self._observe(vehicle, bytes(message.payload[: message.payload_length]))

    def _observe(self, vehicle: VehicleState, payload: bytes) -> None:
        try:
            self.observed.fold(vehicle.sysid, decode_block(payload))
        except WireFormatError:
            vehicle.undecodable += 1


def _is_occupancy(message: Message) -> bool:
    is_tunnel = message.get_type() == "TUNNEL" and message.get_srcComponent() == COMPANION
    return is_tunnel and message.payload_type == PayloadType.OCCUPANCY


def _is_autopilot(message: Message) -> bool:
    return message.get_type() == "HEARTBEAT" and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID
