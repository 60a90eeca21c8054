"""One vehicle that tracks ideally: the companion's planner and flight logic, a simulated sensor, no autopilot."""

import time
from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt

from companion import instructions
from companion.briefing import FlightOrder
from companion.crew import Crew
from companion.events import Odometry
from companion.fleet.exchange import Exchange
from companion.fleet.neighbour import Neighbour
from companion.flight import Flight
from companion.planner.planner import Outlook, Plan, Planner, PlanRequest
from companion.sensing.scan import Scan
from companion.settings import PilotSettings, Reserve, SearchSettings
from missions.frames import AutopilotFrame
from missions.mission_items import Track
from missions.trajectory import Motion, Trajectory
from sitl.sensors.lidar import MOUNT_FLU_M
from tests.benchmarks.onboard.worlds import Course

Array = npt.NDArray[np.float64]

LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
PLAN_TAKES_S = 0.04
"""From a request to its answer: less than the allowance, as on a computer that keeps up."""


class MeasuredPlanner(Planner):
    """A planner whose CPU time is written down [ms]."""

    def __init__(self, course: Course, index: int, seed: int, search: SearchSettings, reserve: Reserve) -> None:
        rng = np.random.default_rng((seed, index))
        zones_m = np.array([course.starts_m[index], course.goals_m[index]])
        super().__init__(course.mission, reserve, search, rng, zones_m)
        self.plan_ms: list[float] = []
        self.map_ms: list[float] = []
        self.tick_ms: list[float] = []
        """Per scan: the check of the committed trajectory, and the plans that were made until the next one."""
        self.witness: Callable[[PlanRequest, Plan, float], None] = lambda *_: None
        """Is told of every replan and its CPU time [ms]."""

    def plan(self, request: PlanRequest) -> Plan:
        began_s = time.thread_time()
        plan = super().plan(request)
        self.plan_ms.append((time.thread_time() - began_s) * 1e3)
        if self.tick_ms:
            self.tick_ms[-1] += self.plan_ms[-1]
        self.witness(request, plan, self.plan_ms[-1])
        return plan

    def observe(self, scan: Scan, neighbours: tuple[Neighbour, ...] = ()) -> None:
        began_s = time.thread_time()
        super().observe(scan, neighbours)
        self.map_ms.append((time.thread_time() - began_s) * 1e3)
        self.tick_ms.append(0.0)

    def outlook(self, trajectory: Trajectory, now_s: float, neighbours: tuple[Neighbour, ...] = ()) -> Outlook:
        began_s = time.thread_time()
        outlook = super().outlook(trajectory, now_s, neighbours)
        if self.tick_ms and self.tick_ms[-1] == 0.0:
            self.tick_ms[-1] = (time.thread_time() - began_s) * 1e3
        return outlook


class Craft:
    """A vehicle on a course; its time is that of the world.

    Args:
        course: what it crosses.
        index: which of the course's vehicles it is.
        seed: of its search.
        search, reserve: of its planner.
    """

    def __init__(
        self,
        course: Course,
        index: int,
        seed: int,
        search: SearchSettings | None = None,
        reserve: Reserve | None = None,
    ) -> None:
        mission = course.mission
        self.goal_m, self._start_m = course.goals_m[index], course.starts_m[index]
        self.planner = MeasuredPlanner(course, index, seed, search or SearchSettings(), reserve or Reserve())
        self.exchange = Exchange(index + 1, mission)
        self._crew = Crew(mission, self.planner, PilotSettings(), 1.0, self.exchange)
        self.frame = AutopilotFrame(mission.origin, mission.frame)
        self._order = FlightOrder(1, Track(self.goal_m[None], np.array([np.nan]), (0,)), self.frame)
        self.flight: Flight | None = None
        self._answers: list[tuple[float, Plan]] = []
        self.notes: list[tuple[float, str]] = []

    def motion(self, now_s: float) -> Motion:
        """Where it is: exactly where it wants to be."""
        if self.flight is None:
            return Motion(self._start_m, np.zeros(3), np.zeros(3))
        return self.flight.course.motion(now_s)

    def odometry(self, now_s: float) -> Odometry:
        """What its estimator says: the truth."""
        motion = self.motion(now_s)
        ahead_ned_m = self.frame.ned(np.array([motion.position_m, motion.position_m + motion.velocity_m_s]))
        return Odometry(now_s, ahead_ned_m[0], ahead_ned_m[1] - ahead_ned_m[0], LEVEL)

    def eye_m(self, now_s: float) -> Array:
        """(3,) where its sensor is, ENU."""
        return self.motion(now_s).position_m + MOUNT_FLU_M

    def see(self, scan: Scan, neighbours: tuple[Neighbour, ...] = ()) -> None:
        """Take in a scan."""
        self.planner.observe(scan, neighbours)

    def tick(self, now_s: float) -> None:
        """What the companion does 50 times a second."""
        if self.flight is None:
            self._begin(now_s)
            return
        while self._answers and self._answers[0][0] <= now_s:
            _, plan = self._answers.pop(0)
            self._carry_out(self.flight.take(plan, self.planner.plan_ms[-1], now_s), now_s)
        self.flight.observe(self.odometry(now_s))
        self._carry_out(self.flight.tick(now_s, 0.0), now_s)

    def _begin(self, now_s: float) -> None:
        """Plan from where it stands; fly as soon as there is a plan."""
        guide = self.planner.lay_guide(self._order.track, 0, self._start_m)
        others = self.exchange.neighbours(now_s, pending=True)
        plan = self.planner.plan(PlanRequest(0, self.motion(now_s), now_s, guide, 0.0, neighbours=others))
        if plan.trajectory is not None:
            self.flight = Flight(self._crew, self._order, plan, self.odometry(now_s), now_s)
            self._carry_out(self.flight.begin(now_s), now_s)

    def _carry_out(self, wanted: Iterator[instructions.Instruction], now_s: float) -> None:
        for instruction in wanted:
            if isinstance(instruction, instructions.RequestPlan):
                self._answers.append((now_s + PLAN_TAKES_S, self.planner.plan(instruction.request)))
            elif isinstance(instruction, instructions.Note):
                self.notes.append((now_s, instruction.text))
