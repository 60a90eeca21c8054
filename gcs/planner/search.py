"""The search for a plan of a whole fleet: cooperative swarms, gradient polish of what they find, the judge's verdict.

The loop, per round: every vehicle's swarm searches against the others' curves; the plan that comes out is polished;
if that looks feasible and better than the best so far, the judge looks at it. Where the judge finds a breach between
the samples that the search looks at, it looks closer from then on and keeps farther away.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from gcs.planner.assembly import Candidate, judged
from gcs.planner.budget import Budget
from gcs.planner.cooperation import Cooperation
from gcs.planner.ecpso import EcpsoSettings
from gcs.planner.fleet_cost import all_control_points
from gcs.planner.flown_plan import NO_FLOWN_PLAN, FlownPlan
from gcs.planner.guide_path import guide_way
from gcs.planner.plan import Progress
from gcs.planner.problem import Care, Route, Way, control_points, guides, guides_along, pose
from gcs.planner.refinement import Refined, Stage, refine
from missions.mission import Mission

Array = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

QUICK = (Stage(30.0, 10), Stage(1000.0, 15))
"""Polish of the first particles: a feasible plan soon."""
LONE_EVALUATIONS = 40
"""Of the first descent of each vehicle."""
THOROUGH = (Stage(1.0, 50), Stage(10.0, 30), Stage(100.0, 20), Stage(1000.0, 20))
"""Polish of what a round of the swarms has found."""
MEND = (Stage(1000.0, 40),)
"""Polish of a plan that is all but feasible ..."""
REPAIR = (Stage(1.0, 30), Stage(10.0, 30), Stage(100.0, 20), Stage(1000.0, 20))
"""... or that the judge refused, once the search looks closer."""
INSISTENT = ((Stage(100.0, 40),), (Stage(10.0, 30), Stage(100.0, 30), Stage(1000.0, 30)))
"""Polish of a first plan that is not feasible yet, but nearly."""
NEARLY_FEASIBLE = 0.1
STUCK = 1e-2
"""A vehicle that cannot get below this sum of squared violations alone is given a guide path at once."""
LOOKS_FEASIBLE = 1e-4
"""A plan with a smaller sum of squared violations, sampled and with margins, is shown to the judge, ..."""
SHOULD_BE_FEASIBLE = 3e-6
"""... but first mended if it has more than this."""
WORTH_JUDGING = 1e-3
"""Relative gain over the best plan so far that makes the judge look before the end."""
PATIENCE = 2
"""Rounds after which vehicles without a flyable curve get a guide path, or a new one."""
AFRESH_EVALUATIONS = 300
"""With fewer evaluations left the search does not start afresh."""
WIDER = 1.25
"""A new guide path keeps so many times farther away than the one before it."""
POINTS_PER_CORNER = 3
"""Control points of curves along guide paths, at first."""
MERIT_STRICTNESS = 100.0
"""Two polished plans are compared with violations weighing so many times more than in the search."""
MOST_RAISES = 5
"""How often the search may be made more careful."""


@dataclass(frozen=True)
class SearchSettings:
    """The parts of the search; each can be switched off, to see what it is worth.

    Args:
        swarm: the parameters of every vehicle's E-CPSO, with switches for its adaptive mechanisms.
        swarms: the swarms search between two polishes.
        bows: first particles are bent to all sides; else there are the straight line and uniformly random ones.
        lone_descents: the first plan is made of the best curve of each vehicle alone.
        polish: what the swarms have found is improved along the gradient.
        guide_paths: vehicles that cannot get through are guided along a path on the grid.
    """

    swarm: EcpsoSettings = field(default_factory=EcpsoSettings)
    swarms: bool = True
    bows: bool = True
    lone_descents: bool = True
    polish: bool = True
    guide_paths: bool = True


EVERYTHING = SearchSettings()
"""The planner as it is meant to be used."""


@dataclass(frozen=True)
class Approved:
    """A plan without violations, and what it costs the search (eq. 13, what slow flight costs, and a change)."""

    candidate: Candidate
    cost: float


class FleetSearch:
    """The search for one mission.

    Args:
        mission: what is to be planned.
        routes: who goes where.
        seed: of all random numbers.
        budget: when to end.
        on_progress: called after every round.
        settings: its parts.
        flown: what is flown meanwhile; plans that differ from it cost more.
        spent: evaluations that were made before.
    """

    def __init__(
        self,
        mission: Mission,
        routes: list[Route],
        seed: int,
        budget: Budget,
        on_progress: Callable[[Progress], None],
        settings: SearchSettings = EVERYTHING,
        flown: FlownPlan = NO_FLOWN_PLAN,
        spent: float = 0.0,
    ) -> None:
        self._mission, self._routes, self._budget, self._on_progress = mission, routes, budget, on_progress
        self._care, self._raises, self._detours = Care(), 0, 0
        self._ways: list[Way | None] = [None] * len(routes)
        self._guides = guides(mission, routes)
        self._settings, self._flown, self._spent = settings, flown, spent
        self._problem = pose(mission, routes, self._guides, self._care)
        self._swarms = Cooperation(self._problem, settings.swarm, np.random.default_rng(seed), settings.bows)
        self._present: Refined | None = None
        self._best: Approved | None = None
        self._polishes = self._iterations = 0
        self.convergence: list[Progress] = []

    @property
    def evaluations(self) -> float:
        """Of whole plans; one vehicle's curve counts as the fleet's share of one."""
        return self._spent + self._polishes + self._swarms.curve_evaluations / len(self._routes)

    @property
    def rank(self) -> tuple[bool, float]:
        """How good the best plan so far is, the lower the better: approved ones come before all others."""
        if self._best is not None:
            return False, self._best.cost
        return True, np.inf if self._present is None else self._merit(self._present)

    def run(self) -> Candidate:
        """Search until the budget is used up: the best plan that the judge approved, or the least bad one."""
        self.begin()
        return self.improve()

    def begin(self) -> None:
        """Find a first plan, from nothing."""
        self._begin(QUICK)
        self._report()

    def begin_along(self, ways: Sequence[Way]) -> None:
        """Take the curves along given ways, one for each vehicle, for the first plan."""
        n_control = control_points(self._mission, ways, POINTS_PER_CORNER)
        self._guides = guides_along(self._mission, ways, n_control)
        self._problem = pose(self._mission, self._routes, self._guides, self._care)
        self._swarms = self._swarms.again(self._problem)
        self._polish(THOROUGH)
        self._insist()
        self._report()

    def count(self, evaluations: float) -> None:
        """So many were made elsewhere meanwhile."""
        self._spent += evaluations

    def improve(self) -> Candidate:
        """Go on from the first plan until the budget is used up; see `run`."""
        while self._budget.share_done(self.evaluations) < 1.0 and not self._budget.interrupted():
            window = self._settings.swarm.window
            if self._budget.left(self.evaluations) > self._swarms.curves_per_round / len(self._routes):
                if self._settings.swarms:
                    self._swarms.round()
                self._iterations += window
            self._polish(THOROUGH)
            if self._best is None and self._iterations % (PATIENCE * window) == 0 and self._has_time():
                self._find_ways_around(self._swarms.violations_alone(self._swarms.offsets) > LOOKS_FEASIBLE)
            self._report()
        assert self._present is not None
        if self._best is not None and self._best.cost <= self._present.objective:
            return self._best.candidate
        last = self._judged(self._present.offsets)
        if self._best is None:
            return last
        is_better = not last.violations and self._cost(self._present, last) < self._best.cost
        return last if is_better else self._best.candidate

    def _begin(self, stages: tuple[Stage, ...]) -> None:
        """The first plan: every vehicle as if it were alone; where that fails, with an eye on the others."""
        if self._settings.lone_descents:
            alone = self._swarms.fly_alone(LONE_EVALUATIONS, STUCK)
            if self._detours == 0 and self._find_ways_around(alone > STUCK):
                return
            self._polish(stages)
            self._insist()
        if self._best is None and not self._budget.interrupted():
            self._swarms.start()
            self._polish(stages)

    def _insist(self) -> None:
        """Go on with a plan that is nearly feasible, as long as that brings it nearer."""
        for stages in INSISTENT:
            if self._best is not None or self._present is None or self._present.violation > NEARLY_FEASIBLE:
                return
            self._polish_from(self._present.offsets, stages)

    def _has_time(self) -> bool:
        """Whether starting afresh may still lead to something."""
        return self._budget.left(self.evaluations) > AFRESH_EVALUATIONS

    def _polish(self, stages: tuple[Stage, ...]) -> None:
        """Polish the swarms' plan; take it over if it is better than the present one, and let the judge see it."""
        self._polish_from(self._swarms.offsets, stages)

    def _polish_from(self, offsets: Array, stages: tuple[Stage, ...]) -> None:
        refined = self._refined(offsets, stages)
        improved = self._present is None or self._rank(refined) < self._rank(self._present)
        if self._present is None or improved:
            self._present = refined
        self._swarms.adopt(self._present.offsets)
        enough = np.inf if self._best is None else self._best.cost - WORTH_JUDGING * abs(self._best.cost)
        if improved and refined.violation < LOOKS_FEASIBLE and refined.objective < enough:
            self._show_judge(refined)

    def _refined(self, offsets: Array, stages: tuple[Stage, ...]) -> Refined:
        left = self._budget.left(self.evaluations)
        wanted = stages if self._settings.polish else ()
        refined = refine(self._problem, offsets, wanted, left, self._budget.interrupted)
        self._polishes += refined.evaluations
        return refined

    def _show_judge(self, refined: Refined) -> None:
        if refined.violation > SHOULD_BE_FEASIBLE:
            self._present = refined = self._refined(refined.offsets, MEND)
        candidate = self._judged(refined.offsets)
        if candidate.violations:
            self._look_closer(refined.offsets)
            return
        if self._best is None:
            self._budget = self._budget.settled(self.evaluations)
        cost = self._cost(refined, candidate)
        if self._best is None or cost < self._best.cost:
            self._best = Approved(candidate, cost)

    def _cost(self, refined: Refined, candidate: Candidate) -> float:
        return refined.objective + self._flown.change_cost(self._mission, candidate.curves)

    def _find_ways_around(self, stuck: BoolArray) -> bool:
        """Give vehicles that cannot even fly alone a guide path around what is in their way, and start afresh.

        Each further time the path keeps farther away from everything, and the curves get more control points.

        Args:
            stuck: (vehicles,) which they are.

        Returns:
            Whether there was anything to start afresh with.
        """
        if not stuck.any() or not self._settings.guide_paths:
            return False
        for index in np.flatnonzero(stuck):
            way = guide_way(self._mission, self._routes[index], WIDER**self._detours)
            if way is not None:
                self._ways[index] = way
            elif self._detours == 0:  # as far as can be told, there is none: no use in being stubborn
                self._budget = self._budget.settled(self.evaluations)
        if not any(self._ways):
            return False
        ways = [way or route.straight for way, route in zip(self._ways, self._routes, strict=True)]
        n_control = control_points(self._mission, ways, POINTS_PER_CORNER * (1 + self._detours))
        self._detours += 1
        self._guides = guides_along(self._mission, ways, n_control)
        self._problem = pose(self._mission, self._routes, self._guides, self._care)
        self._swarms = self._swarms.again(self._problem)
        self._present = None
        self._begin(THOROUGH)
        return True

    def _look_closer(self, offsets: Array) -> None:
        """Mend a breach that the search did not see, and see such ones from now on."""
        if self._raises == MOST_RAISES:
            assert self._present is not None
            self._present = replace(
                self._present, violation=np.inf
            )  # whatever comes next is better than a refused plan
            return
        self._raises += 1
        self._care = self._care.raised()
        self._problem = pose(self._mission, self._routes, self._guides, self._care)
        self._swarms.pose(self._problem)
        self._present = None
        self._polish_from(offsets, REPAIR)

    def _rank(self, refined: Refined) -> tuple[bool, float]:
        """The lower the better: what looks feasible comes before whatever does not."""
        return refined.violation >= LOOKS_FEASIBLE, self._merit(refined)

    def _merit(self, refined: Refined) -> float:
        return refined.objective + MERIT_STRICTNESS * self._problem.terms.penalty_weight * refined.violation

    def _judged(self, offsets: Array) -> Candidate:
        return judged(self._mission, self._routes, all_control_points(self._problem, offsets))

    def _report(self) -> None:
        assert self._present is not None
        found = self._merit(self._present) if self._best is None else self._best.cost
        share_done = self._budget.share_done(self.evaluations)
        progress = Progress(self._iterations, int(self.evaluations), found, self._best is not None, share_done)
        self.convergence.append(progress)
        self._on_progress(progress)
