"""What is flown: the committed trajectory, the one that follows it, and how far along the guide they have come."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from companion.planner.planner import Plan
from companion.setpoints import in_ned
from missions.frames import AutopilotFrame
from missions.trajectory import Motion, Trajectory

Array = npt.NDArray[np.float64]

LOOK_AHEAD_M = 2.0
"""Progress is looked for so far ahead on the guide, and more where the vehicle is fast."""


@dataclass(frozen=True)
class Leg:
    """One committed trajectory, in the mission's frame and in the autopilot's."""

    trajectory: Trajectory
    ned: Trajectory


class Course:
    """The committed trajectory of a vehicle in control.

    Trajectories follow one another without a jump: each begins in the state of the one before it.

    Args:
        plan: the first one; it has a trajectory.
        frame: the autopilot's.
    """

    def __init__(self, plan: Plan, frame: AutopilotFrame) -> None:
        assert plan.trajectory is not None
        self._frame = frame
        self._present = self._next = self._leg_of(plan.trajectory)
        self.guide, self.arc_m, self.reaches_end = plan.guide, plan.arc_m, plan.reaches_end

    def commit(self, plan: Plan, now_s: float) -> None:
        """Fly another plan's trajectory from its beginning on."""
        assert plan.trajectory is not None
        self._append(plan.trajectory, now_s)
        self.guide, self.arc_m, self.reaches_end = plan.guide, plan.arc_m, plan.reaches_end

    def brake(self, trajectory: Trajectory, now_s: float) -> None:
        """Fly a trajectory that comes to rest on the way."""
        self._append(trajectory, now_s)
        self.reaches_end = False

    def reframe(self, frame: AutopilotFrame) -> None:
        """The autopilot's frame has moved: convert anew."""
        self._frame = frame
        self._present, self._next = self._leg_of(self._present.trajectory), self._leg_of(self._next.trajectory)

    def trajectory(self, now_s: float) -> Trajectory:
        """The trajectory that is flown at a time."""
        return self._leg(now_s).trajectory

    @property
    def latest(self) -> Trajectory:
        """The trajectory that was committed last; it may begin in the future."""
        return self._next.trajectory

    def motion(self, now_s: float) -> Motion:
        """The motion at a time, mission ENU."""
        return self.trajectory(now_s).at(now_s)

    def motion_ned(self, now_s: float) -> Motion:
        """The motion at a time, in the autopilot's frame."""
        return self._leg(now_s).ned.at(now_s)

    def advance(self, now_s: float) -> None:
        """Notice how far along the guide the vehicle has come."""
        motion = self.motion(now_s)
        reach_m = LOOK_AHEAD_M + float(np.linalg.norm(motion.velocity_m_s))
        self.arc_m = self.guide.project(motion.position_m, self.arc_m, reach_m)

    @property
    def track_index(self) -> int:
        """Index of the track point that is flown to."""
        return self.guide.next_index(self.arc_m)

    def _append(self, trajectory: Trajectory, now_s: float) -> None:
        self._present, self._next = self._leg(now_s), self._leg_of(trajectory)

    def _leg_of(self, trajectory: Trajectory) -> Leg:
        return Leg(trajectory, in_ned(trajectory, self._frame))

    def _leg(self, now_s: float) -> Leg:
        return self._next if now_s >= self._next.trajectory.start_s else self._present
