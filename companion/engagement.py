"""Taking over from hovering: wait until the vehicle stands, plan, stream where it stands, enter OFFBOARD. Sans-IO."""

from collections.abc import Iterator

import numpy as np

from companion import instructions
from companion.briefing import FlightOrder
from companion.crew import Crew
from companion.events import FlightMode, Odometry
from companion.instructions import Instruction
from companion.planner.planner import Plan, PlanRequest
from companion.setpoints import Setpoint
from missions.trajectory import Motion
from missions.tunnel import Reason


class Engagement:
    """From an accepted MISSION_START to OFFBOARD.

    Args:
        crew: planner and settings.
        order: what is to be flown.
        current_seq: the mission item that is flown to.
        mode_before: the autopilot's mode at the start; but for a take-off that ends, only OFFBOARD may follow.
        now_s: vehicle time of the start.
    """

    def __init__(self, crew: Crew, order: FlightOrder, current_seq: int, mode_before: FlightMode, now_s: float) -> None:
        self.order = order
        self.mode_before = mode_before
        self.plan: Plan | None = None
        """The first trajectory; setpoints are streamed as soon as there is one."""
        self.failure = Reason.NONE
        self._crew = crew
        self._index = order.track.index_of(current_seq)
        self._since_s = self._ask_at_s = now_s
        self._asked: PlanRequest | None = None

    def tick(self, odometry: Odometry, now_s: float) -> Iterator[Instruction]:
        """Go on, or notice that it takes too long."""
        waited_s, settings = now_s - self._since_s, self._crew.settings
        if self.plan is not None:
            yield self._standing(self.plan, odometry)
            if waited_s > settings.offboard_timeout_s:
                self.failure = Reason.OFFBOARD_REFUSED
        elif waited_s > settings.standing_timeout_s:
            self.failure = Reason.NO_PATH
        elif self._wants_plan(odometry, now_s):
            self._asked = self._request(odometry, now_s)
            yield instructions.RequestPlan(self._asked)

    def take(self, plan: Plan, odometry: Odometry, now_s: float) -> Iterator[Instruction]:
        """With a path found, enter OFFBOARD; the stream has to be there first."""
        if self.plan is not None or plan.request is not self._asked:
            return
        if plan.trajectory is None:  # what is in the way may be another vehicle that is about to go on
            self._asked, self._ask_at_s = None, now_s + self._crew.settings.retry_s
            return
        self.plan, self._since_s = plan, now_s
        yield self._standing(plan, odometry)
        yield instructions.CommandMode(FlightMode.OFFBOARD)

    def _wants_plan(self, odometry: Odometry, now_s: float) -> bool:
        stands = bool(np.linalg.norm(odometry.velocity_m_s) < self._crew.settings.standing_m_s)
        return self._asked is None and now_s >= self._ask_at_s and stands

    def _request(self, odometry: Odometry, now_s: float) -> PlanRequest:
        """From the hovering position along what remains of the track."""
        place_m = self.order.frame.enu(odometry.position_m)
        guide = self._crew.planner.lay_guide(self.order.track, self._index, place_m)
        at_rest = Motion(place_m, np.zeros(3), np.zeros(3))
        others = self._crew.exchange.neighbours(now_s, pending=True)
        return PlanRequest(self._crew.next_number(), at_rest, now_s, guide, 0.0, neighbours=others)

    def _standing(self, plan: Plan, odometry: Odometry) -> instructions.SendSetpoint:
        """Hover where the first trajectory begins."""
        place_ned_m = self.order.frame.ned(plan.request.start.position_m)
        return instructions.SendSetpoint(Setpoint(place_ned_m, np.zeros(3), np.zeros(3), odometry.yaw_rad))
