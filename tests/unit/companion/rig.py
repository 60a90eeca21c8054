"""A pilot on a bench: events are fed by hand, instructions are kept, and a planner answers with straight lines."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from companion import events, instructions
from companion.events import FlightMode
from companion.instructions import CommandResult
from companion.pilot import Pilot
from companion.planner.braking import brake_along
from companion.planner.guide import Guide, lay_guide
from companion.planner.limits import flight_limits
from companion.planner.planner import Outlook, Plan, PlanRequest
from companion.settings import CompanionSettings, PlanningMode, Reserve
from missions.frames import AutopilotFrame, GeodeticPoint
from missions.mission import Mission, load_mission
from missions.mission_items import MissionItem, Track, encode_track
from missions.trajectory import Motion, Trajectory
from missions.tunnel import Reason

INDOOR = load_mission("indoor")
GCS = events.Sender(255, 190)
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
"""The attitude of a vehicle that stands still and looks north."""
START_M = np.array([1.0, 6.5, 1.5])
HOME = INDOOR.frame.geodetic(np.array([1.0, 6.5, 0.0]))
TRACK_M = np.array([[4.0, 5.0, 1.5], [7.0, 4.2, 1.5], [12.0, 5.5, 1.5], [19.0, 8.5, 1.5]])

ACTING = (instructions.SendSetpoint, instructions.CommandMode)

Kind = TypeVar("Kind")


def items_of(points_m: np.ndarray = TRACK_M, speed_m_s: float = 3.0) -> tuple[MissionItem, ...]:
    """A mission through the given ENU points."""
    return encode_track(Track(points_m, np.full(len(points_m), speed_m_s)), INDOOR.frame, acceptance_radius_m=0.3)


class StraightPlanner:
    """Plans straight lines of two seconds towards the next track point; finds nothing when it is told so."""

    voxel_m = 0.1

    def __init__(self) -> None:
        self.limits = flight_limits(INDOOR, Reserve())
        self.clear = True
        self.blind = False

    def lay_guide(self, track: Track, index: int, from_m: np.ndarray) -> Guide:
        return lay_guide(track, index, from_m, INDOOR.onboard.horizon_m, self.limits)

    def join_track(self, track: Track, index: int, start: Motion) -> Guide:
        return self.lay_guide(track, index, start.position_m)

    def outlook(self, trajectory: Trajectory, now_s: float) -> Outlook:
        return Outlook(np.inf, np.inf, np.inf) if self.clear else Outlook(now_s, now_s, np.inf)

    def brake(self, trajectory: Trajectory, now_s: float) -> Trajectory:
        return brake_along(trajectory, now_s, self.limits.acceleration_m_s2)

    def plan(self, request: PlanRequest) -> Plan:
        if self.blind:
            return Plan(request, None, request.guide, request.arc_m)
        goal_arc_m = min(request.arc_m + 4.0, request.guide.length_m)
        goal_m = request.guide.point(goal_arc_m)
        knot_s, (place, velocity, acceleration) = 0.4, request.start
        drift, bend = velocity * knot_s, acceleration * knot_s**2 / 3.0
        first = np.array([place - drift + bend, place - 0.5 * bend, place + drift + bend])
        middle = np.linspace(first[2], goal_m, 5)[1:-1]
        control_m = np.vstack((first, middle, np.tile(goal_m, (3, 1))))
        trajectory = Trajectory(control_m, request.start_s, knot_s)
        return Plan(request, trajectory, request.guide, request.arc_m, goal_arc_m >= request.guide.length_m)


@dataclass
class Rig:
    """A pilot and a vehicle that is wherever its last setpoint was."""

    mission: Mission = INDOOR
    mode: PlanningMode = PlanningMode.END_CLOUD
    now_s: float = 100.0
    sent: list[Any] = field(default_factory=list)
    answers_plans: bool = True
    follows: bool = True
    """The vehicle does what its setpoints say."""
    sensor_silent: bool = False
    planner: Any = None

    def __post_init__(self) -> None:
        self.planner = self.planner or StraightPlanner()
        self.pilot = Pilot(self.mission, CompanionSettings(vehicle=1, system_url="", mode=self.mode), self.planner)
        self.frame = AutopilotFrame(HOME, self.mission.frame, HOME.altitude_amsl_m - INDOOR.origin.altitude_amsl_m)
        self.place_ned_m = self.frame.ned(START_M)
        self.velocity_ned_m_s = np.zeros(3)

    # ------------------------------------------------------------------ what happens

    def feed(self, *happened: events.Event) -> list[Any]:
        """Feed events; the instructions that came out."""
        out: list[Any] = []
        for event in happened:
            out += self.pilot.handle(event, self.now_s)
        for instruction in out:
            if isinstance(instruction, instructions.SendSetpoint) and self.follows:
                self.place_ned_m = instruction.setpoint.position_m
                self.velocity_ned_m_s = instruction.setpoint.velocity_m_s
        self.sent += out
        return out

    def run(self, duration_s: float, until: Callable[[], bool] = lambda: False) -> list[Any]:
        """Let vehicle time pass: ticks, odometry, answers to plan requests."""
        out: list[Any] = []
        end_s = self.now_s + duration_s
        while self.now_s < end_s and not until():
            self.now_s += 0.02
            n_before = len(out)
            out += self.feed(self.odometry(), events.Tick(0.0, sensor_silent=self.sensor_silent))
            for wanted in of(out[n_before:], instructions.RequestPlan) if self.answers_plans else []:
                out += self.feed(self.answer(wanted.request))
        return out

    def odometry(self) -> events.Odometry:
        return events.Odometry(self.now_s, self.place_ned_m, self.velocity_ned_m_s, LEVEL)

    def answer(self, request: PlanRequest) -> events.PlanReady:
        return events.PlanReady(self.planner.plan(request), 2.0)

    # --------------------------------------------------------------- usual beginnings

    def connect(self) -> "Rig":
        self.feed(
            events.AutopilotFound(),
            events.ModeReported(FlightMode.HOLD),
            events.OriginReported(HOME),
            events.HomeReported(HOME),
            self.odometry(),
        )
        return self

    def ready(self, items: tuple[MissionItem, ...] | None = None) -> "Rig":
        self.connect()
        self.load(items_of() if items is None else items)
        return self

    def load(self, items: tuple[MissionItem, ...], identity: int = 7, current_seq: int = 0) -> list[Any]:
        """The ground station has stored a mission in the autopilot."""
        out = self.feed(events.MissionReported(identity, current_seq))
        return out + self.feed(events.MissionDownloaded(identity, items))

    def airborne(self) -> "Rig":
        self.ready()
        self.feed(events.ArmingReported(True), events.LandedReported(False))
        return self

    def start(self) -> list[Any]:
        return self.feed(events.StartCommanded(GCS))

    def flying(self) -> "Rig":
        self.airborne()
        self.start()
        self.run(0.1)
        self.feed(events.ModeCommandEnded(FlightMode.OFFBOARD, True), events.ModeReported(FlightMode.OFFBOARD))
        return self

    def at_target(self) -> "Rig":
        """Flown to the end; the mode that ends the flight has just been commanded."""
        self.flying()
        self.run(60.0, until=lambda: bool(of(self.sent, instructions.CommandMode)[1:]))
        return self


def of(found: list[Any], kind: type[Kind]) -> list[Kind]:
    """Those of a kind."""
    return [instruction for instruction in found if isinstance(instruction, kind)]


def acts(found: list[Any]) -> bool:
    """Whether any of them moves the vehicle."""
    return any(isinstance(instruction, ACTING) for instruction in found)


def acknowledgement(found: list[Any]) -> tuple[CommandResult, Reason]:
    """The one answer to a MISSION_START of the ground station."""
    (ack,) = of(found, instructions.AcknowledgeStart)
    assert ack.sender == GCS
    return ack.result, ack.reason


def moved(place: GeodeticPoint, north_deg: float) -> GeodeticPoint:
    """A place a little farther north."""
    return GeodeticPoint(
        latitude_deg=place.latitude_deg + north_deg,
        longitude_deg=place.longitude_deg,
        altitude_amsl_m=place.altitude_amsl_m,
    )


def with_home(altitude_m: float) -> events.HomeReported:
    """Home at another altitude."""
    return events.HomeReported(
        GeodeticPoint(latitude_deg=HOME.latitude_deg, longitude_deg=HOME.longitude_deg, altitude_amsl_m=altitude_m)
    )
