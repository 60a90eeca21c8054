"""One flight under the companion's control: setpoints, progress, replanning, braking, arrival. Sans-IO."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from companion import instructions
from companion.briefing import FlightOrder
from companion.course import Course
from companion.crew import Crew
from companion.events import Odometry
from companion.instructions import Instruction
from companion.planner.planner import Plan, PlanRequest
from companion.setpoints import Heading, Setpoint
from missions.frames import AutopilotFrame
from missions.trajectory import Motion, Trajectory
from missions.tunnel import Reason, TrajectoryKind, TrajectoryMessage

Array = npt.NDArray[np.float64]

NEARLY_DONE_S = 2.0
"""A trajectory that reaches its target so soon is not replanned for its age."""
PROGRESS_INTERVAL_S = 0.1
BLIND = {Reason.NO_POSITION, Reason.NO_SENSOR}
"""Whoever does not know where it is, or what is around, makes no plans."""


class Flight:
    """From the first setpoint to the last.

    Args:
        crew: planner, settings, figures.
        order: what is flown.
        plan: the first trajectory; it begins at rest.
        odometry: the latest estimate.
        now_s: vehicle time at which it begins.
    """

    def __init__(self, crew: Crew, order: FlightOrder, plan: Plan, odometry: Odometry, now_s: float) -> None:
        assert plan.trajectory is not None
        self._crew = crew
        self.order = order
        self._new_order: FlightOrder | None = None
        self.course = Course(replace(plan, trajectory=replace(plan.trajectory, start_s=now_s)), order.frame)
        self.holding = Reason.NONE
        """Why the vehicle is braked to a hover, if it is."""
        settings = crew.settings
        self._heading = Heading(odometry.yaw_rad, settings.yaw_rate_rad_s, settings.yaw_above_m_s)
        self._odometry = odometry
        self._last_s = now_s
        self._advanced_s = -np.inf
        self._asked: PlanRequest | None = None
        self._asked_order = order
        self._retry_at_s = now_s
        self._announced_item = -1
        self._blocked = False
        """The committed trajectory is not clear any more, and not braked on yet."""

    @property
    def track_index(self) -> int:
        return self.course.track_index

    @property
    def newest_order(self) -> FlightOrder:
        """What is flown, or will be from the next plan on."""
        return self._new_order or self.order

    def begin(self) -> Iterator[Instruction]:
        """Announce the first trajectory."""
        yield self._announcement(self.course.latest, TrajectoryKind.COMMITTED)

    def reframe(self, frame: AutopilotFrame) -> None:
        """The autopilot's frame has moved; where the vehicle is to fly has not."""
        self.order = replace(self.order, frame=frame)
        self.course.reframe(frame)

    def observe(self, odometry: Odometry) -> None:
        """Take in an estimate of where the vehicle is."""
        self._odometry = odometry
        self._crew.figures.tracking_error_m.add(self._error_m(odometry.time_s))

    def change_order(self, order: FlightOrder) -> None:
        """Fly another track from the next plan on."""
        self._new_order, self._asked, self._retry_at_s = order, None, -np.inf

    def tick(self, now_s: float, odometry_age_s: float, *, sensor_silent: bool = False) -> Iterator[Instruction]:
        """Stream on; look ahead; ask for a plan when there is a reason."""
        yield instructions.SendSetpoint(self.setpoint(now_s))
        if now_s - self._advanced_s >= PROGRESS_INTERVAL_S:
            self._advanced_s = now_s
            self.course.advance(now_s)
            yield from self._announce_progress()
        trouble = self._trouble(now_s, odometry_age_s, sensor_silent)
        yield from self._note_blocked(trouble is Reason.NO_PATH and self.holding is Reason.NONE)
        if trouble is not Reason.NONE and self.holding is Reason.NONE and not self._can_wait(trouble, now_s):
            yield from self.brake(trouble, now_s)
        if trouble not in BLIND and self._wants_plan(now_s):
            yield instructions.RequestPlan(self._request(now_s))

    def take(self, plan: Plan, cpu_ms: float, now_s: float) -> Iterator[Instruction]:
        """Commit a plan that was asked for, if it is one and still in time."""
        if self._asked is None or plan.request is not self._asked:
            return
        self._asked = None
        self._crew.figures.replan_ms.add(cpu_ms)
        late_s = now_s - plan.request.start_s
        if plan.trajectory is None:
            self._retry_at_s = now_s + self._crew.settings.retry_s
            yield instructions.Note("no path found", {"replan_ms": cpu_ms})
        elif late_s > self._crew.lateness_s:
            yield instructions.Note("plan came too late", {"late_s": late_s, "replan_ms": cpu_ms})
        elif self.holding is not Reason.STOPPED_BY_OPERATOR:
            self._commit(plan, now_s)
            yield instructions.Note("plan committed", {"replan_ms": cpu_ms, "reaches_end": plan.reaches_end})
            yield self._announcement(plan.trajectory, TrajectoryKind.COMMITTED)

    def brake(self, reason: Reason, now_s: float) -> Iterator[Instruction]:
        """Come to rest along the committed trajectory; plans that are under way are not waited for."""
        self.holding, self._asked, self._retry_at_s = reason, None, now_s
        braking = self._crew.planner.brake(self.course.trajectory(now_s), now_s)
        self.course.brake(braking, now_s)
        yield instructions.Note("braking", {"reason": reason.name, "stops_in_s": braking.duration_s})
        yield self._announcement(braking, TrajectoryKind.BRAKING)

    def is_at_rest(self, now_s: float) -> bool:
        """The committed trajectory has come to its end."""
        return now_s >= self.course.latest.end_s

    def has_arrived(self, now_s: float) -> bool:
        """At rest at the target; a vehicle that does not quite get there has arrived after a while as well."""
        if not (self.course.reaches_end and self._new_order is None and self.is_at_rest(now_s)):
            return False
        settings = self._crew.settings
        near = self._error_m(now_s) < 0.5 * self._crew.mission.site.arrival_tolerance_m
        slow = bool(np.linalg.norm(self._odometry.velocity_m_s) < settings.arrived_m_s)
        return (near and slow) or now_s > self.course.latest.end_s + settings.arrival_timeout_s

    def setpoint(self, now_s: float) -> Setpoint:
        """What the vehicle shall be doing now."""
        used_s = now_s + self._crew.settings.setpoint_lead_s
        motion = self.course.motion_ned(used_s)
        ahead = self.course.motion_ned(used_s + self._crew.settings.response_lead_s)
        yaw_rad = self._heading.follow(motion.velocity_m_s, now_s - self._last_s)
        self._last_s = now_s
        return Setpoint(motion.position_m, ahead.velocity_m_s, ahead.acceleration_m_s2, yaw_rad)

    def _announcement(self, trajectory: Trajectory, kind: TrajectoryKind) -> instructions.SendTrajectory:
        """What is told to the others about a trajectory; its time is vehicle time still."""
        message = TrajectoryMessage(
            kind=kind,
            plan_id=self.order.plan_id,
            revision=self._crew.figures.replans,
            radius_m=self._crew.mission.limits.body_radius_m,
            trajectory=trajectory,
        )
        return instructions.SendTrajectory(message)

    def _commit(self, plan: Plan, now_s: float) -> None:
        self.course.commit(plan, now_s)
        self.holding = Reason.NONE
        self._crew.figures.replans += 1
        if self._asked_order is not self.order:
            self.order, self._new_order, self._announced_item = self._asked_order, None, -1

    def _wants_plan(self, now_s: float) -> bool:
        if self._asked is not None or now_s < self._retry_at_s or self.holding is Reason.STOPPED_BY_OPERATOR:
            return False
        if self._new_order is not None or self._blocked or self.holding is not Reason.NONE:
            return True
        latest = self.course.latest
        if self.course.reaches_end and now_s > latest.end_s - NEARLY_DONE_S:
            return False
        return now_s - latest.start_s >= self._crew.settings.replan_age_s

    def _request(self, now_s: float) -> PlanRequest:
        start_s = now_s + self._crew.allowance_s
        on_course = self._error_m(now_s) <= self._crew.lost_track_m
        start = self.course.motion(start_s) if on_course else self._estimate(start_s)
        guide, arc_m = self.course.guide, self.course.arc_m
        self._asked_order = self._new_order or self.order
        if self._new_order is not None:
            guide, arc_m = self._crew.planner.lay_guide(self._new_order.track, 0, start.position_m), 0.0
        committed = self.course.trajectory(start_s) if on_course else None
        self._asked = PlanRequest(self._crew.next_number(), start, start_s, guide, arc_m, committed)
        return self._asked

    def _estimate(self, at_s: float) -> Motion:
        """Where the vehicle itself will be, as far as odometry tells."""
        odometry, frame = self._odometry, self.order.frame
        place_ned_m = odometry.position_m + odometry.velocity_m_s * (at_s - odometry.time_s)
        ahead_m = frame.enu(np.array([place_ned_m, place_ned_m + odometry.velocity_m_s]))
        return Motion(ahead_m[0], ahead_m[1] - ahead_m[0], np.zeros(3))

    def _trouble(self, now_s: float, odometry_age_s: float, sensor_silent: bool) -> Reason:
        """Why the vehicle should not go on as it does."""
        if odometry_age_s > self._crew.settings.odometry_timeout_s:
            return Reason.NO_POSITION
        if sensor_silent:
            return Reason.NO_SENSOR
        if not self._crew.planner.is_clear(self.course.trajectory(now_s), now_s):
            return Reason.NO_PATH
        ended = self.is_at_rest(now_s) and not self.course.reaches_end
        return Reason.NO_PATH if ended else Reason.NONE

    def _note_blocked(self, blocked: bool) -> Iterator[Instruction]:
        """A trajectory that is blocked ahead is a reason to plan anew, whatever its age."""
        if blocked and not self._blocked:
            self._retry_at_s = -np.inf
            yield instructions.Note("blocked ahead")
        self._blocked = blocked

    def _can_wait(self, trouble: Reason, now_s: float) -> bool:
        """Whether a new plan can be waited for: one could still stop on the way when it does not come."""
        if trouble is not Reason.NO_PATH or self.is_at_rest(now_s):
            return False
        planner, later_s = self._crew.planner, now_s + self._crew.allowance_s
        return planner.is_clear(planner.brake(self.course.trajectory(later_s), later_s), later_s)

    def _announce_progress(self) -> Iterator[Instruction]:
        seq = self.order.track.item_seq[self.track_index]
        if seq != self._announced_item:
            self._announced_item = seq
            yield instructions.SetCurrentItem(seq)

    def _error_m(self, time_s: float) -> float:
        """Distance of the last estimate from where the vehicle should have been at a time."""
        return float(np.linalg.norm(self._odometry.position_m - self.course.motion_ned(time_s).position_m))
