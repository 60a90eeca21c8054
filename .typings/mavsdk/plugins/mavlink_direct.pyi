"""What the companion uses of MAVSDK's mavlink_direct plugin."""

from collections.abc import Callable

from mavsdk.system import System

class MavlinkMessage:
    message_name: str
    system_id: int
    component_id: int
    target_system_id: int
    target_component_id: int
    fields_json: str
    def __init__(
        self,
        message_name: str | None = None,
        system_id: int | None = None,
        component_id: int | None = None,
        target_system_id: int | None = None,
        target_component_id: int | None = None,
        fields_json: str | None = None,
    ) -> None: ...

class MavlinkDirect:
    def __init__(self, system: System) -> None: ...
    def send_message(self, message: MavlinkMessage) -> object: ...
    def subscribe_message(
        self,
        message_name: str,
        callback: Callable[[MavlinkMessage, None], object],
    ) -> object: ...
    def send_command(self, command: MavlinkMessage) -> MavlinkMessage: ...
    def destroy(self) -> None: ...
