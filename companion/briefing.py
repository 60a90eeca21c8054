"""What a pilot must know before it can fly: where the autopilot's frame lies, and which track it is to fly."""

from dataclasses import dataclass, field

import numpy as np

from companion.settings import PlanningMode
from missions.errors import WireFormatError
from missions.frames import AutopilotFrame, GeodeticPoint
from missions.mission import Mission, Vehicle
from missions.mission_items import MissionItem, Track, decode_track, plan_id
from missions.tunnel import Reason

WIRE_TOLERANCE_M = 0.05
"""A track point that has travelled as latitude, longitude and altitude is where it was to within this."""


@dataclass(frozen=True)
class FlightOrder:
    """A mission as it was understood: what to fly, in which frame.

    Args:
        plan_id: of the mission items.
        track: decoded, with the vehicle's ground offset.
        frame: the autopilot's.
    """

    plan_id: int
    track: Track
    frame: AutopilotFrame


@dataclass
class Briefing:
    """Collects what the autopilot reports, and says what is still missing.

    Args:
        mission: the mission file.
        vehicle: this one.
        mode: with ONBOARD, only those track points are flown that are targets.
    """

    mission: Mission
    vehicle: Vehicle
    mode: PlanningMode = PlanningMode.END_CLOUD
    origin: GeodeticPoint | None = None
    home: GeodeticPoint | None = None
    identity: int = 0
    """Of the mission that the autopilot has stored; 0 for none."""
    current_seq: int = 0
    items: tuple[MissionItem, ...] = ()
    plan_id: int = 0
    """Of the items; 0 for none."""
    downloaded_identity: int = 0
    problem: str = ""
    """Why the mission was not understood."""
    sensor_silent: bool = False
    """There is to be a range sensor, and it is not heard."""
    _order: FlightOrder | None = field(default=None, repr=False)

    def forget(self) -> None:
        """The autopilot is gone, perhaps rebooted: everything that it said is void."""
        self.origin = self.home = self._order = None
        self.identity = self.downloaded_identity = self.current_seq = 0
        self.items, self.plan_id, self.problem = (), 0, ""

    @property
    def ground_offset_m(self) -> float:
        """What the autopilot's altitude reads too high [m]: its home altitude against where its pad is."""
        assert self.home is not None
        return self.home.altitude_amsl_m - self.mission.origin.altitude_amsl_m - self.vehicle.pad_m[2]

    @property
    def frame(self) -> AutopilotFrame | None:
        """The autopilot's frame, once its origin and home are known."""
        if self.origin is None or self.home is None:
            return None
        return AutopilotFrame(self.origin, self.mission.frame, self.ground_offset_m)

    @property
    def wants_download(self) -> bool:
        return self.identity not in (0, self.downloaded_identity)

    def accept(self, identity: int, items: tuple[MissionItem, ...]) -> None:
        """Take over a downloaded mission."""
        self.downloaded_identity, self.items, self.plan_id = identity, items, plan_id(items)
        self.decode()

    def decode(self) -> None:
        """Understand the downloaded mission anew: it, or the frame, has changed."""
        self._order, self.problem, frame = None, "", self.frame
        if frame is None or not self.items:
            return
        try:
            track = decode_track(self.items, self.mission.frame, ground_offset_m=frame.ground_offset_m)
        except WireFormatError as wrong:
            self.problem = str(wrong)
            return
        if not np.all(np.isfinite(track.points_m)):
            self.problem = "a waypoint is not a place"
            return
        if self.mode is PlanningMode.ONBOARD:
            track = self._targets_of(track)
        self._order = FlightOrder(self.plan_id, track, frame)

    def _targets_of(self, track: Track) -> Track:
        """The points of a track that are targets of the mission, and its last one."""
        targets_m = np.array([target.position_m for target in self.mission.targets])
        off_m = np.linalg.norm(track.points_m[:, None] - targets_m, axis=2).min(axis=1)
        off_m[-1] = 0.0
        kept = np.flatnonzero(off_m < WIRE_TOLERANCE_M).tolist()
        return Track(track.points_m[kept], track.speeds_m_s[kept], tuple(track.item_seq[i] for i in kept))

    @property
    def order(self) -> FlightOrder | None:
        """What is to be flown, once everything is there and understood."""
        return self._order

    @property
    def missing(self) -> Reason:
        """What keeps this vehicle from being ready; NONE when nothing does."""
        if self.frame is None:
            return Reason.NO_POSITION
        if not self.items:
            return Reason.NO_MISSION
        if self._order is None:
            return Reason.MISSION_NOT_UNDERSTOOD
        return Reason.NO_SENSOR if self.sensor_silent else Reason.NONE
