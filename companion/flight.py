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
from companion.planner.guide import Guide
from companion.planner.planner import Plan, PlanRequest
from companion.setpoints import Heading, Setpoint
from companion.traffic import Traffic
from missions.frames import AutopilotFrame
from missions.mission_items import Track
from missions.trajectory import Motion, Trajectory, at_rest
from missions.tunnel import Reason, TrajectoryKind, TrajectoryMessage

Array = npt.NDArray[np.float64]

NEARLY_DONE_S = 2.0
"""A trajectory that reaches its target so soon is not replanned for its age."""
PROGRESS_INTERVAL_S = 0.1
HOVER_LONGER_S = 0.2
"""A vehicle whose first plan has to be announced hovers until then, and for so long if the plan is withdrawn."""
BRAKES_EARLIER_S = 0.3
"""A collision with another vehicle is braked for so much before it has to be; until then it is planned around."""
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
        self._traffic = Traffic(crew.exchange, crew.planner, crew.mission.limits)
        self._first = replace(plan, trajectory=replace(plan.trajectory, start_s=now_s + self._traffic.wait_s(now_s)))
        self.course = Course(self._hovering(plan.trajectory, now_s), order.frame)
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
        self._replan_ms = 0.0
        self._announced_item = -1
        self._conflict_s = self._danger_s = np.inf  # when the committed trajectory meets something, and hard
        self._asked_aside = self._asked_wanted = False
        self._left_track_at: int | None = None
        """The track point that was flown to when the vehicle began to make way for another one."""

    @property
    def track_index(self) -> int:
        return self.course.track_index if self._left_track_at is None else self._left_track_at

    @property
    def newest_order(self) -> FlightOrder:
        """What is flown, or will be from the next plan on."""
        return self._new_order or self.order

    def begin(self, now_s: float) -> Iterator[Instruction]:
        """Announce the first trajectory, and fly it when nobody objects."""
        hover = self.course.latest
        self._traffic.fly(TrajectoryKind.COMMITTED, hover, self.order.plan_id, now_s)
        yield self._announcement(hover, TrajectoryKind.COMMITTED)
        yield from self._offer(self._first, 0.0, now_s)

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
        self._traffic.withdraw()

    def tick(self, now_s: float, odometry_age_s: float, *, sensor_silent: bool = False) -> Iterator[Instruction]:
        """Stream on; look ahead; ask for a plan when there is a reason."""
        yield instructions.SendSetpoint(self.setpoint(now_s))
        if now_s - self._advanced_s >= PROGRESS_INTERVAL_S:
            self._advanced_s = now_s
            self.course.advance(now_s)
            yield from self._announce_progress()
        yield from self._decide(now_s)
        latest = self.course.latest
        self._traffic.look(latest, now_s, idle=self.course.reaches_end and self.is_at_rest(now_s))
        meets_s = self._traffic.conflict_s(latest, now_s)
        outlook = self._crew.planner.outlook(latest, now_s)
        self._conflict_s = min(outlook.lacks_s, outlook.too_fast_s, meets_s - BRAKES_EARLIER_S)
        self._danger_s = min(outlook.dangerous_s, meets_s - BRAKES_EARLIER_S)
        trouble = self._trouble(now_s, odometry_age_s, sensor_silent)
        if trouble is not Reason.NONE and self.holding is Reason.NONE:
            yield from self.brake(trouble, now_s)
        if trouble not in BLIND and self._wants_plan(now_s):
            yield instructions.RequestPlan(self._request(now_s))

    def take(self, plan: Plan, cpu_ms: float, now_s: float) -> Iterator[Instruction]:
        """Commit a plan that was asked for, if it is one and still in time."""
        if self._asked is None or plan.request is not self._asked:
            return
        self._asked = None
        self._crew.figures.replan_ms.add(cpu_ms)
        late_s = now_s + self._traffic.wait_s(now_s) - plan.request.start_s
        if self._asked_wanted:
            self._traffic.want(plan.trajectory, self.order.plan_id, now_s)
        elif plan.trajectory is None:
            self._traffic.note_no_path(plan.request.start.position_m, now_s)
            settings, urgent = self._crew.settings, self._conflict_s < np.inf or self._new_order is not None
            self._retry_at_s = now_s + (settings.conflict_retry_s if urgent else settings.retry_s)
            yield instructions.Note("no path found", {"replan_ms": cpu_ms})
        elif late_s > self._crew.lateness_s:
            yield instructions.Note("plan came too late", {"late_s": late_s, "replan_ms": cpu_ms})
        elif self.holding is not Reason.STOPPED_BY_OPERATOR:
            yield from self._offer(plan, cpu_ms, now_s)

    def brake(self, reason: Reason, now_s: float) -> Iterator[Instruction]:
        """Come to rest along the committed trajectory; plans that are under way are not waited for."""
        self.holding, self._asked, self._retry_at_s = reason, None, now_s
        braking = self._crew.planner.brake(self.course.trajectory(now_s), now_s)
        self.course.brake(braking, now_s)
        self._traffic.fly(TrajectoryKind.BRAKING, braking, self.order.plan_id, now_s)
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

    def _hovering(self, trajectory: Trajectory, now_s: float) -> Plan:
        """The first plan, or a hover where it begins while it has to be announced."""
        assert self._first.trajectory is not None
        wait_s = self._first.trajectory.start_s - now_s
        if wait_s == 0.0:
            return self._first
        hover = at_rest(trajectory.at(trajectory.start_s).position_m, now_s, wait_s + HOVER_LONGER_S)
        return replace(self._first, trajectory=hover, reaches_end=False)

    def _offer(self, plan: Plan, cpu_ms: float, now_s: float) -> Iterator[Instruction]:
        """Announce a plan; fly it at once when nobody is there to object."""
        assert plan.trajectory is not None
        wait_s = self._traffic.wait_s(now_s)
        self._replan_ms = cpu_ms
        if wait_s > 0.0:
            self._traffic.offer(plan, plan.trajectory, self.order.plan_id, wait_s, now_s)
        elif plan.trajectory is not self.course.latest:
            self._traffic.fly(TrajectoryKind.COMMITTED, plan.trajectory, self.order.plan_id, now_s)
            yield from self._commit(plan, now_s)

    def _decide(self, now_s: float) -> Iterator[Instruction]:
        """Fly a plan that was announced for long enough, unless somebody is in its way."""
        decision = self._traffic.decision(now_s)
        if decision is None:
            return
        if decision.clear and self.holding is not Reason.STOPPED_BY_OPERATOR:
            yield from self._commit(decision.plan, now_s)
        else:
            self._retry_at_s = now_s
            self._traffic.note_no_path(self.course.motion(now_s).position_m, now_s)
            yield instructions.Note("plan withdrawn", {"waited_s": decision.waited_s})

    def _commit(self, plan: Plan, now_s: float) -> Iterator[Instruction]:
        assert plan.trajectory is not None
        if self._asked_aside and self._left_track_at is None:
            self._left_track_at = self.course.track_index
        elif not self._asked_aside:
            self._left_track_at = None
        self.course.commit(replace(plan, reaches_end=plan.reaches_end and not self._asked_aside), now_s)
        yield instructions.Note("plan committed", {"replan_ms": self._replan_ms, "reaches_end": plan.reaches_end})
        self.holding = Reason.NONE
        self._crew.figures.replans += 1
        if self._asked_order is not self.order:
            self.order, self._new_order, self._announced_item = self._asked_order, None, -1
        yield self._announcement(plan.trajectory, TrajectoryKind.COMMITTED)

    def _wants_plan(self, now_s: float) -> bool:
        if self._asked is not None or now_s < self._retry_at_s or self.holding is Reason.STOPPED_BY_OPERATOR:
            return False
        if self._traffic.is_waiting or self._traffic.is_aside(self.course.latest):
            return False
        if self._traffic.makes_way or self._left_track_at is not None:
            return True
        if self._new_order is not None or self.holding is not Reason.NONE:
            return True
        latest = self.course.latest
        if self._conflict_s < np.inf:
            return True
        if self.course.reaches_end and now_s > latest.end_s - NEARLY_DONE_S:
            return False
        return now_s - latest.start_s >= self._crew.settings.replan_age_s

    def _request(self, now_s: float) -> PlanRequest:
        start_s = now_s + self._crew.allowance_s + self._traffic.wait_s(now_s)
        on_course = self._error_m(now_s) <= self._crew.lost_track_m
        start = self.course.motion(start_s) if on_course else self._estimate(start_s)
        self._asked_order = self._new_order or self.order
        guide, arc_m = self._guide(start)
        committed = self.course.trajectory(start_s) if on_course else None
        self._asked_wanted = self._traffic.shall_want(now_s)
        others = self._traffic.before(now_s) if self._asked_wanted else self._traffic.neighbours(now_s)
        self._asked = PlanRequest(self._crew.next_number(), start, start_s, guide, arc_m, committed, others)
        return self._asked

    def _guide(self, start: Motion) -> tuple[Guide, float]:
        """What the next plan follows, and how much of it is done: the track, or a way aside."""
        join, aside_m = self._crew.planner.join_track, self._traffic.place_aside_m
        self._asked_aside = self._traffic.makes_way and aside_m is not None
        if self._asked_aside and aside_m is not None:
            return join(Track(aside_m[None], np.array([np.nan]), (0,)), 0, start), 0.0
        if self._new_order is not None:
            return join(self._new_order.track, 0, start), 0.0
        if self._left_track_at is not None:
            return join(self.order.track, self._left_track_at, start), 0.0
        return self.course.guide, self.course.arc_m

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
        if self._danger_s - now_s < self._brakes_s(now_s):
            return Reason.NO_PATH
        ended = self.is_at_rest(now_s) and not self.course.reaches_end
        waits = self._left_track_at is not None and not self._traffic.is_stuck(now_s)
        return Reason.NO_PATH if ended and not waits and not self._traffic.makes_way else Reason.NONE

    def _brakes_s(self, now_s: float) -> float:
        """Whoever meets something within this time brakes instead of waiting for a plan [s]."""
        speed_m_s = float(np.linalg.norm(self.course.motion(now_s).velocity_m_s))
        stops_s = speed_m_s / self._crew.planner.limits.acceleration_m_s2
        return stops_s + self._crew.allowance_s + self._crew.settings.tick_s

    def _announce_progress(self) -> Iterator[Instruction]:
        seq = self.order.track.item_seq[self.track_index]
        if seq != self._announced_item:
            self._announced_item = seq
            yield instructions.SetCurrentItem(seq)

    def _error_m(self, time_s: float) -> float:
        """Distance of the last estimate from where the vehicle should have been at a time."""
        return float(np.linalg.norm(self._odometry.position_m - self.course.motion_ned(time_s).position_m))
