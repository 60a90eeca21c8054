"""Lets vehicles fly a course and scores what they did, by the truth."""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from companion.sensing.scan import Scan
from companion.settings import Reserve, SearchSettings
from missions import obstacles
from sitl.sensors.lidar import RangeSensors, flu_to_enu
from tests.benchmarks.onboard.craft import LEVEL, Craft
from tests.benchmarks.onboard.worlds import Course

Array = npt.NDArray[np.float64]

TICK_S = 0.02
TIME_LIMIT_S = 60.0
REACHED_M = 0.30
AT_REST_M_S = 0.05


@dataclass
class Score:
    """What one vehicle has done.

    Args:
        reached: at rest within 0.30 m of its goal in time.
        clearance_m: least distance of its centre to anything, standing or moving.
        separation_m: least distance to another vehicle's centre; infinite for one alone.
        outside_m: how far it left the flight range.
        time_s: until it was at rest at its goal.
        length_m: of its path.
        acceleration_m_s2: the highest.
        jerk: integral of squared jerk, acceleration differenced at 50 Hz [m2/s5].
        plan_ms, map_ms, tick_ms: CPU times.
    """

    reached: bool
    clearance_m: float
    separation_m: float
    outside_m: float
    time_s: float
    length_m: float
    acceleration_m_s2: float
    speed_m_s: float
    jerk: float
    plan_ms: list[float] = field(repr=False)
    map_ms: list[float] = field(repr=False)
    tick_ms: list[float] = field(repr=False)
    path_m: Array = field(repr=False)
    notes: list[tuple[float, str]] = field(repr=False)

    def succeeded(self, body_radius_m: float) -> bool:
        """Reached, without touching anything, within the flight range."""
        apart = self.separation_m >= 2.0 * body_radius_m
        return self.reached and self.clearance_m >= body_radius_m and apart and self.outside_m == 0.0


def fly(course: Course, search: SearchSettings | None = None, reserve: Reserve | None = None) -> list[Score]:
    """Let all vehicles of a course fly, each for itself; nobody tells anybody anything."""
    return cross(course, [Craft(course, i, course.seed, search, reserve) for i in range(len(course.starts_m))])


def cross(course: Course, crafts: list[Craft]) -> list[Score]:
    """Let crafts fly the course for which they were made."""
    eyes = Eyes(course)
    flown = Flown(course)
    for step in range(int(TIME_LIMIT_S / TICK_S)):
        now_s = step * TICK_S
        for craft, scan in zip(crafts, eyes.scans(now_s, crafts), strict=False):
            craft.see(scan)
        for craft in crafts:
            craft.tick(now_s)
        flown.note(now_s, crafts)
        if flown.all_done:
            break
    return flown.scores(crafts)


class Eyes:
    """The range sensors of all vehicles, level as their vehicles are."""

    def __init__(self, course: Course) -> None:
        self._sensors = RangeSensors(course.mission, np.random.default_rng((course.seed, 3)))
        self._range_m = course.mission.sensor.range_m

    def scans(self, now_s: float, crafts: list[Craft]) -> list[Scan]:
        """One scan per vehicle if it is time for one, else none."""
        if not self._sensors.is_due(now_s):
            return []
        positions = np.array([craft.motion(now_s).position_m for craft in crafts])
        seen = self._sensors.scan(now_s, positions, np.tile(LEVEL, (len(crafts), 1)), np.full(len(crafts), now_s))
        return [
            Scan(now_s, craft.eye_m(now_s), place_m + flu_to_enu(one.points_flu_m, LEVEL), self._range_m)
            for craft, place_m, one in zip(crafts, positions, seen, strict=True)
        ]


class Flown:
    """What the vehicles of a course do, tick by tick."""

    def __init__(self, course: Course) -> None:
        self._course = course
        self._times: list[float] = []
        self._motions: list[Array] = []
        n = len(course.starts_m)
        self._done_at: list[int | None] = [None] * n

    @property
    def all_done(self) -> bool:
        return all(step is not None for step in self._done_at)

    def note(self, now_s: float, crafts: list[Craft]) -> None:
        """Write down where everybody is."""
        motions = np.array([craft.motion(now_s) for craft in crafts])  # (n, 3, 3)
        self._times.append(now_s)
        self._motions.append(motions)
        for index, craft in enumerate(crafts):
            near = np.linalg.norm(motions[index, 0] - craft.goal_m) < REACHED_M
            slow = np.linalg.norm(motions[index, 1]) < AT_REST_M_S
            if self._done_at[index] is None and near and slow:
                self._done_at[index] = len(self._times) - 1

    def scores(self, crafts: list[Craft]) -> list[Score]:
        """What everybody has done until it reached its goal; distances count to the very end."""
        motions = np.array(self._motions)  # (t, n, 3, 3)
        return [self._score(index, craft, motions) for index, craft in enumerate(crafts)]

    def _score(self, index: int, craft: Craft, motions: Array) -> Score:
        done, places_m = self._done_at[index], motions[:, index, 0]
        own = motions[: (len(motions) if done is None else done) + 1, index]
        others_m = np.delete(motions[:, :, 0], index, axis=1)
        apart_m = np.linalg.norm(others_m - places_m[:, None], axis=2)
        bounds = self._course.mission.world.bounds
        outside_m = np.maximum(bounds.low_enu_m - places_m, places_m - bounds.high_enu_m).max()
        jerk = np.diff(own[:, 2], axis=0) / TICK_S
        return Score(
            reached=done is not None,
            clearance_m=self._clearance_m(places_m),
            separation_m=float(apart_m.min(initial=np.inf)),
            outside_m=max(float(outside_m), 0.0),
            time_s=self._times[len(own) - 1],
            length_m=float(np.linalg.norm(np.diff(own[:, 0], axis=0), axis=1).sum()),
            acceleration_m_s2=float(np.linalg.norm(own[:, 2], axis=1).max()),
            speed_m_s=float(np.linalg.norm(own[:, 1], axis=1).max()),
            jerk=float(np.sum(jerk**2) * TICK_S),
            plan_ms=craft.planner.plan_ms,
            map_ms=craft.planner.map_ms,
            tick_ms=craft.planner.tick_ms,
            path_m=own[:, 0],
            notes=craft.notes,
        )

    def _clearance_m(self, places_m: Array) -> float:
        world = self._course.mission.world
        least_m = float(obstacles.clearance(places_m, obstacles.pack(world)).min())
        for mover in world.movers:
            centres_m = np.array([mover.position(time_s) for time_s in self._times])
            least_m = min(least_m, float((np.linalg.norm(places_m - centres_m, axis=1) - mover.radius_m).min()))
        return least_m
