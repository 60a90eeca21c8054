"""The same worlds in closed loop: autopilot, physics, noisy estimates and lidar of the simulator, in process.

The whole companion flies, as its program does, from take-off to a hover at the goal; what is scored begins when the
vehicle leaves its start.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import msgspec
import numpy as np

from gcs.settings import PlanningMode
from missions import obstacles
from missions.mission import OnArrival
from tests.benchmarks.onboard.flights import REACHED_M, fly
from tests.benchmarks.onboard.single import Part
from tests.benchmarks.onboard.worlds import COURSES, LIMITS, Course
from tests.benchmarks.planner.figures import Figure, Table
from tests.simulation.whole_system import WholeSystem

SLOWER = 1.15
"""Flight time against that with ideal tracking, at most."""
TRACKING_M = 0.35
"""99th percentile of the distance between vehicle and setpoint at 3 m/s, at most."""
SETTLED_M_S = 0.3
HEADER = ("world", "success", "clearance m, least", "time s", "with ideal tracking s", "tracking error p99 m")


@dataclass(frozen=True)
class Loop:
    """One flight in closed loop.

    Args:
        reached: it came to rest near its goal, and the ground station calls the flight a success.
        clearance_m: least distance of the centre to anything while it crosses.
        time_s: from leaving the start to rest near the goal.
        tracking_m: 99th percentile of the tracking error.
    """

    reached: bool
    clearance_m: float
    time_s: float
    tracking_m: float

    @property
    def succeeded(self) -> bool:
        return self.reached and self.clearance_m >= LIMITS.body_radius_m


def fly_in_loop(course: Course) -> Loop:
    """Let the one vehicle of a course fly."""
    mission = msgspec.structs.replace(course.mission, on_arrival=OnArrival.HOLD)
    system = WholeSystem(mission, mode=PlanningMode.ONBOARD, seed=course.seed)
    report = system.fly()
    flown = system.flown()[1]
    from_start_m = np.linalg.norm(flown.positions_m - course.starts_m[0], axis=1)
    to_goal_m = np.linalg.norm(flown.positions_m - course.goals_m[0], axis=1)
    slow = np.linalg.norm(flown.velocities_m_s, axis=1) < SETTLED_M_S
    crossing = np.flatnonzero(
        (from_start_m > REACHED_M) & (np.abs(flown.positions_m[:, 2] - course.starts_m[0, 2]) < 1.0)
    )
    hovering = np.flatnonzero(from_start_m < REACHED_M)
    begin = int(hovering[-1]) if len(hovering) else int(crossing[0]) if len(crossing) else 0
    arrived = np.flatnonzero((to_goal_m < REACHED_M) & slow & (np.arange(len(slow)) > begin))
    end = int(arrived[0]) if len(arrived) else len(slow) - 1
    places_m = flown.positions_m[begin : end + 1]
    clearance_m = float(obstacles.clearance(places_m, obstacles.pack(course.mission.world)).min())
    return Loop(
        bool(len(arrived)) and report.success and not system.simulator.collisions,
        clearance_m,
        float(flown.times_s[end] - flown.times_s[begin]),
        system.companions[1].pilot.figures.tracking_error_m.at(0.99),
    )


def closed_loop(seeds: range, worlds: Iterable[str]) -> Iterator[Part]:
    """Fly every course both ways; clearance is that to what stands."""
    table, figures = Table("One vehicle, closed loop with the simulated autopilot", HEADER), list[Figure]()
    for world in worlds:
        courses = [COURSES[world](seed) for seed in seeds]
        loops, ideal = [fly_in_loop(course) for course in courses], [fly(course)[0] for course in courses]
        both = [(a, b) for a, b in zip(loops, ideal, strict=True) if a.succeeded and b.succeeded(LIMITS.body_radius_m)]
        time_s = float(np.mean([loop.time_s for loop, _ in both])) if both else np.inf
        ideal_s = float(np.mean([score.time_s for _, score in both])) if both else np.inf
        tracking_m = max(loop.tracking_m for loop in loops)
        succeeded = sum(loop.succeeded for loop in loops)
        least_m = min(loop.clearance_m for loop in loops)
        table.rows.append(
            (
                world,
                f"{succeeded}/{len(loops)}",
                f"{least_m:.2f}",
                f"{time_s:.2f}",
                f"{ideal_s:.2f}",
                f"{tracking_m:.2f}",
            )
        )
        as_many = sum(score.succeeded(LIMITS.body_radius_m) for score in ideal)
        figures += [
            Figure(f"{world}, closed loop: flights that succeed", succeeded, as_many, at_least=True, unit="flights"),
            Figure(
                f"{world}, closed loop: flight time against ideal tracking",
                time_s / ideal_s if both else np.inf,
                SLOWER,
                unit="times",
            ),
            Figure(f"{world}, closed loop: tracking error p99", tracking_m, TRACKING_M, unit="m"),
        ]
    yield table, figures
