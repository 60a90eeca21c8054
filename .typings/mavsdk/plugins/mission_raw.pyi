"""What the companion uses of MAVSDK's mission_raw plugin."""

from mavsdk.system import System

class MissionItem:
    seq: int
    frame: int
    command: int
    current: int
    autocontinue: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: int
    y: int
    z: float
    mission_type: int

class MissionRaw:
    def __init__(self, system: System) -> None: ...
    def download_mission(self) -> list[MissionItem]: ...
    def set_current_mission_item(self, index: int) -> object: ...
