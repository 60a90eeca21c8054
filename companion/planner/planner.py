"""The door of the onboard planner: a request in, a trajectory that ends at rest (or the reason why not) out."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from companion.fleet.neighbour import POSITION_ERROR_M, Neighbour
from companion.mapping.local_map import LocalMap, View
from companion.mapping.sorting import Known
from companion.planner.braking import brake_along
from companion.planner.detours import lead_around
from companion.planner.dominance import objective_weights
from companion.planner.evaluation import HARD
from companion.planner.guide import MERGED_M, Guide, lay_guide, run_out
from companion.planner.limits import Surroundings, flight_limits, free_space, surroundings
from companion.planner.local_plan import Horizon, LocalPlanner, plan_along, warm_way
from companion.planner.mopso import search_plan
from companion.planner.reference import Way
from companion.planner.safety import first_lack
from companion.planner.spline_shape import spline_shape
from companion.planner.traffic import traffic
from companion.sensing.scan import Scan
from companion.settings import Reserve, SearchSettings
from missions import obstacles
from missions.mission import Mission
from missions.mission_items import Track
from missions.trajectory import Motion, Trajectory

Array = npt.NDArray[np.float64]

CELLS_PER_VOXEL = 2.0
KNOWN_WITHIN_VOXELS = 2.0
"""What is seen so near to a known surface is that surface."""
REACH_FARTHER = 1.05
"""The map knows distances a little beyond what is asked for."""
SLOWEST_SCALE = 2.5
"""No plan takes longer than this multiple of its reference."""
LONGEST_DURATION = 2.2
"""A plan lasts no longer than so many times the horizon at cruise speed: its knots stay close together."""


@dataclass(frozen=True)
class PlanRequest:
    """One replan.

    Args:
        number: comes back with the answer.
        start: the state in which the trajectory begins, ENU.
        start_s: when it begins, vehicle time [s].
        guide: what is followed.
        arc_m: how much of the guide is done.
        committed: the trajectory being flown, to begin the search with.
        neighbours: other vehicles to keep away from.
    """

    number: int
    start: Motion
    start_s: float
    guide: Guide
    arc_m: float
    committed: Trajectory | None = None
    neighbours: tuple[Neighbour, ...] = ()


@dataclass(frozen=True)
class Plan:
    """The answer to a request.

    Args:
        request: what was asked.
        trajectory: None when there is no path.
        guide: the request's, or one that was led around something.
        arc_m: how much of this guide is done.
        reaches_end: it comes to rest at the end of the guide.
    """

    request: PlanRequest
    trajectory: Trajectory | None
    guide: Guide
    arc_m: float
    reaches_end: bool = False


class Outlook(NamedTuple):
    """When a trajectory breaks what the mission requires, vehicle time [s]; infinite where it never does."""

    lacks_s: float
    """For the first time: reason enough for another plan."""
    dangerous_s: float
    """By more than the reserve, which is more than the map's noise: reason enough to brake."""
    too_fast_s: float
    """It passes something faster than it has to: what was not seen yet when it was planned. Another plan slows down."""


class Planner:
    """Plans for one vehicle of one mission.

    Args:
        mission: world, limits, horizon.
        reserve: how much of the limits is used.
        search: settings of the swarm.
        rng: all randomness.
        zones_m: (z, 3) centres of launch zones: where this vehicle's curve starts, and its target.
    """

    def __init__(
        self, mission: Mission, reserve: Reserve, search: SearchSettings, rng: np.random.Generator, zones_m: Array
    ) -> None:
        horizon_m, phi = mission.onboard.horizon_m, mission.planner
        self.limits = flight_limits(mission, reserve)
        self.around = surroundings(mission, obstacles.pack(mission.world.as_known()), zones_m)
        self.local = LocalPlanner(
            self.limits,
            Horizon(horizon_m, LONGEST_DURATION * horizon_m / mission.limits.cruise_speed_m_s),
            spline_shape(search.control_points),
            search_plan(search, objective_weights(phi.length_weight, phi.clearance_weight, phi.height_weight)),
        )
        self._rng, self._mission_limits = rng, mission.limits
        self._seen_beside_m = 2.0 * POSITION_ERROR_M[mission.site] + 0.5 * mission.onboard.voxel_m
        """A neighbour is seen so far from where it says it is: both are wrong about where they are."""
        self._map = LocalMap(
            Known(
                self.around.obstacles,
                self.around.room_m,
                KNOWN_WITHIN_VOXELS * mission.onboard.voxel_m,
                self.limits.clearance_m + self.limits.reserve_m,
            ),
            mission.onboard.voxel_m,
            REACH_FARTHER * max(self.limits.avoidance_distance_m, self.limits.clearance_m + self.limits.reserve_m),
            mission.limits.body_radius_m,
        )
        self.voxel_m = mission.onboard.voxel_m
        self.cell_m = CELLS_PER_VOXEL * self.voxel_m
        self._strictly = False
        """The next guide is led around narrow places as well."""

    @property
    def horizon_m(self) -> float:
        return self.local.horizon.length_m

    def lay_guide(self, track: Track, index: int, from_m: Array) -> Guide:
        """The guide from a place along the rest of a track, not yet led around anything."""
        return lay_guide(track, index, from_m, self.horizon_m, self.limits)

    def join_track(self, track: Track, index: int, start: Motion) -> Guide:
        """The guide from a state of motion along the rest of a track: who cannot turn at once runs out a little."""
        over_m = run_out(track, index, start, self.limits)
        if over_m is not None and not self.may_rest(over_m[None])[0]:
            over_m = None
        return lay_guide(track, index, start.position_m, self.horizon_m, self.limits, over_m)

    def observe(self, scan: Scan, neighbours: tuple[Neighbour, ...] = ()) -> None:
        """Take a scan into the map. One thread at a time may plan or observe; `is_clear` may be asked by another.

        Args:
            scan: what was seen.
            neighbours: vehicles that say where they are: they are not mapped.
        """
        beside_m = self._seen_beside_m
        bodies = [(*other.trajectory.at(scan.time_s).position_m, other.radius_m + beside_m) for other in neighbours]
        self._map.observe(scan, np.array(bodies, dtype=float).reshape(-1, 4))

    @property
    def seen(self) -> View:
        """What the map holds now; never changed."""
        return self._map.view

    def certain(self) -> tuple[Array, Array, Array]:
        """What has been seen for certain, to be told to others; see `LocalMap.certain`."""
        return self._map.certain()

    def plan(self, request: PlanRequest) -> Plan:
        """Plan along the request's guide, which is first led around what blocks it.

        Where no plan squeezes past a narrow place that way, it is led around narrow places as well: at once if nothing
        else had to be led around, which would take too long twice, and with the next request otherwise.
        """
        around = self._around(request.start.position_m, request.start_s, request.neighbours)
        guide, arc_m = self._led(request, around, strictly=self._strictly)
        plan = self._plan_along(request, guide, arc_m, around)
        if plan.trajectory is not None or guide is not request.guide:
            self._strictly = plan.trajectory is None and not self._strictly
            return plan
        other, arc_m = self._led(request, around, strictly=not self._strictly)
        return plan if other is request.guide else self._plan_along(request, other, arc_m, around)

    def is_clear(self, trajectory: Trajectory, now_s: float, neighbours: tuple[Neighbour, ...] = ()) -> bool:
        """The rest of a trajectory has no conflict."""
        return self.outlook(trajectory, now_s, neighbours).lacks_s == np.inf

    def outlook(self, trajectory: Trajectory, now_s: float, neighbours: tuple[Neighbour, ...] = ()) -> Outlook:
        """When the rest of a trajectory first breaks what the mission requires (the reserve is not asked for).

        It is judged against what is known, what was seen until now, movers as they are expected, and the neighbours'
        trajectories. May be asked in another thread than plans are made in.
        """
        begin_s = max(now_s, trajectory.start_s)
        around = self._around(trajectory.at(begin_s).position_m, begin_s, neighbours)
        done = min(max(now_s - trajectory.start_s, 0.0), trajectory.duration_s) / trajectory.knot_interval_s
        control_m, knot_s = trajectory.control_points_m, trajectory.knot_interval_s
        lacks_s, dangerous_s, too_fast_s = first_lack(control_m, knot_s, done, self.limits, around)
        return Outlook(begin_s + lacks_s, begin_s + dangerous_s, begin_s + too_fast_s)

    def may_rest(self, places_m: Array) -> npt.NDArray[np.bool_]:
        """Which of (n, 3) places are clear enough to rest there, as far as is known and was seen."""
        places_m, free_m = np.ascontiguousarray(places_m, dtype=float), np.empty(len(places_m))
        free_space(places_m, 0.0, self.around._replace(field=self._map.view.field), free_m)
        low_m, high_m = self.around.room_m
        inside = np.all((places_m >= low_m) & (places_m <= high_m), axis=1)
        return inside & (free_m >= self.limits.clearance_m + self.limits.reserve_m)

    def _around(self, place_m: Array, begin_s: float, neighbours: tuple[Neighbour, ...]) -> Surroundings:
        """Everything around a vehicle that is at a place at a time."""
        view, longest_s = self._map.view, SLOWEST_SCALE * self.local.horizon.duration_s
        moving = traffic(view.movers, neighbours, self._mission_limits, begin_s, longest_s, place_m)
        return self.around._replace(field=view.field, moving=moving)

    def brake(self, trajectory: Trajectory, now_s: float) -> Trajectory:
        """Come to rest on the committed path as soon as the limits allow."""
        return brake_along(trajectory, now_s, self.limits.acceleration_m_s2)

    def _led(self, request: PlanRequest, around: Surroundings, *, strictly: bool) -> tuple[Guide, float]:
        """The request's guide led around what blocks it, or itself if there is no way; and how much of it is done."""
        place_m, arc_m, quick = np.asarray(request.start.position_m), request.arc_m, request.committed is not None
        size = (self.horizon_m, self.cell_m)
        guide = lead_around(request.guide, around, self.limits, *size, arc_m, place_m, strictly=strictly, quick=quick)
        if guide is None or guide is request.guide:  # without a way around, as far as it goes
            return request.guide, request.arc_m
        begun_anew = np.linalg.norm(guide.way.points_m[0] - place_m) < MERGED_M
        from_m = 0.0 if begun_anew else max(request.arc_m - self.horizon_m, 0.0)
        return guide, guide.project(place_m, from_m, 2.0 * self.horizon_m)

    def _plan_along(self, request: PlanRequest, guide: Guide, arc_m: float, around: Surroundings) -> Plan:
        start = np.ascontiguousarray(request.start, dtype=float)
        warm = self._warm_way(request.committed, request.start_s, guide, arc_m)
        plan = plan_along(guide.way, arc_m, start, warm, self.local, around, self._rng)
        trajectory = Trajectory(plan.control_m, request.start_s, plan.knot_s)
        if plan.value[HARD] > 0.0 or not self.is_clear(trajectory, request.start_s, request.neighbours):
            return Plan(request, None, guide, arc_m)
        return Plan(request, trajectory, guide, arc_m, plan.goal_arc_m >= guide.length_m)

    def _warm_way(self, committed: Trajectory | None, start_s: float, guide: Guide, arc_m: float) -> Way:
        """The committed path from the plan's start on, and then the guide; without samples if there is none."""
        if committed is None:
            return Way(np.empty((0, 5)), np.empty(0))
        done_s = min(max(start_s - committed.start_s, 0.0), committed.duration_s)
        done = done_s / committed.knot_interval_s
        return warm_way(committed.control_points_m, done, guide.way, arc_m, self.limits.corridor_m)
