"""Several vehicles at once: swaps and columns with permuted goals, and the link between them.

Nobody has a plan from the ground: what keeps vehicles apart is what they tell each other, frame by frame, over a radio
that loses and delays. Each vehicle sees the others with its sensor, too.
"""

from collections import deque
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import numpy.typing as npt

from companion.events import LandedReported, UtcReported
from companion.fleet.desk import FleetDesk
from companion.link.fleet_frames import FleetFrames
from missions.mission import LinkSettings
from missions.world import Bounds, Box, World
from sitl.link.radio import FleetRadio
from tests.benchmarks.onboard.craft import Craft
from tests.benchmarks.onboard.flights import TICK_S, TIME_LIMIT_S, Eyes, Flown, Score
from tests.benchmarks.onboard.worlds import HEIGHT_M, Course, course, forest_world, room_world

Array = npt.NDArray[np.float64]

BEGIN_UTC_S = 1_767_225_600.0
TALKS_BEFORE_S = 1.5
"""Vehicles hover and hear each other for so long before they start, as they do between take-off and MISSION_START."""
LINKS: dict[str, LinkSettings] = {
    "ideal": LinkSettings(),
    "100 ms": LinkSettings(delay_s=0.1),
    "300 ms": LinkSettings(delay_s=0.3),
    "20 % loss": LinkSettings(loss=0.2),
}
"""What the air between any two vehicles does."""


class Talk:
    """The radio between some crafts, and everybody's end of it.

    Args:
        course: what is flown.
        crafts: who talks.
        link: what happens on the way between any two.
    """

    def __init__(self, course: Course, crafts: list[Craft], link: LinkSettings) -> None:
        self._heard: dict[int, deque[bytes]] = {craft.exchange.sysid: deque() for craft in crafts}
        self._radio = FleetRadio(link, self._heard, course.seed)
        self._now_s = 0.0
        self.desks = [self._desk(course, craft) for craft in crafts]

    def carry(self, now_s: float) -> None:
        """Bring everything that has arrived to where it is heard."""
        self._now_s = now_s
        for sysid, datagram in self._radio.arrived(now_s):
            self._heard[sysid].append(datagram)

    def _desk(self, course: Course, craft: Craft) -> FleetDesk:
        sysid, frames = craft.exchange.sysid, FleetFrames(craft.exchange.sysid, course.mission.frame)
        desk = FleetDesk(craft.exchange, course.mission, frames, partial(self._poll, sysid), partial(self._send, sysid))
        desk.notice(UtcReported(BEGIN_UTC_S))
        desk.notice(LandedReported(False))
        return desk

    def _poll(self, sysid: int) -> Iterator[bytes]:
        while self._heard[sysid]:
            yield self._heard[sysid].popleft()

    def _send(self, sysid: int, datagram: bytes) -> None:
        self._radio.send(sysid, datagram, self._now_s, None)


def fly_together(course: Course, link: LinkSettings) -> list[Score]:
    """Let all vehicles of a course fly, telling each other their plans."""
    crafts = [Craft(course, index, course.seed) for index in range(len(course.starts_m))]
    talk, eyes, flown = Talk(course, crafts, link), Eyes(course), Flown(course)
    for step in range(-round(TALKS_BEFORE_S / TICK_S), int(TIME_LIMIT_S / TICK_S)):
        now_s = step * TICK_S
        talk.carry(now_s)
        for craft, scan in zip(crafts, eyes.scans(now_s, crafts) if step >= 0 else [], strict=False):
            craft.see(scan, craft.exchange.neighbours(now_s))
        for craft, desk in zip(crafts, talk.desks, strict=True):
            desk.listen(now_s)
            if step >= 0:
                craft.tick(now_s)
            desk.notice(craft.odometry(now_s))
            desk.speak(craft.frame, now_s)
        if step >= 0:
            flown.note(now_s, crafts)
        if flown.all_done:
            break
    return flown.scores(crafts)


# ------------------------------------------------------------------------ courses
def swap(seed: int) -> Course:
    """Two vehicles change places, head-on."""
    starts_m = np.array([[1.0, 7.0, HEIGHT_M], [19.0, 7.0, HEIGHT_M]])
    return course("swap", seed, room_world(seed), starts_m, starts_m[::-1])


def column(n: int, world: Callable[[int], World], name: str) -> Callable[[int], Course]:
    """`n` vehicles in a column with permuted goals, odd ones the other way."""

    def laid_out(seed: int) -> Course:
        laid = world(seed)
        (west, east), (south, north) = laid.bounds.east_m, laid.bounds.north_m
        rows_m = np.linspace(south + 1.0, north - 1.0, n)
        goals_m = rows_m[np.random.default_rng((seed, 4)).permutation(n)]
        sides = np.where(np.arange(n) % 2 == 0, west + 1.0, east - 1.0)
        across = west + east - sides
        height = np.full(n, HEIGHT_M)
        starts, ends = np.column_stack((sides, rows_m, height)), np.column_stack((across, goals_m, height))
        return course(name, seed, laid, starts, ends)

    return laid_out


def doorway(seed: int) -> Course:
    """Two rooms with a door of 1.2 m between them; one vehicle on each side wants to the other."""
    rng = np.random.default_rng((seed, 5))
    door_m = 5.0 + rng.uniform(-1.5, 1.5)
    walls = tuple(
        Box(name=name, centre_m=(6.0, (low + high) / 2.0, 1.5), half_m=(0.15, (high - low) / 2.0, 1.5), known=False)
        for name, low, high in (("south wall", 0.0, door_m - 0.6), ("north wall", door_m + 0.6, 10.0))
    )
    world = World(bounds=Bounds(east_m=(0.0, 12.0), north_m=(0.0, 10.0), up_m=(0.0, 3.0)), boxes=walls)
    starts_m = np.array([[2.0, door_m, HEIGHT_M], [10.0, door_m, HEIGHT_M]])
    return course("doorway", seed, world, starts_m, starts_m[::-1])


def corridor(seed: int) -> Course:
    """A corridor of 1.2 m between two rooms, too narrow for two; one vehicle at each end wants to the other."""
    rng = np.random.default_rng((seed, 6))
    middle_m = 5.0 + rng.uniform(-1.0, 1.0)
    walls = tuple(
        Box(name=name, centre_m=(8.0, (low + high) / 2.0, 1.5), half_m=(2.0, (high - low) / 2.0, 1.5), known=False)
        for name, low, high in (("south block", 0.0, middle_m - 0.6), ("north block", middle_m + 0.6, 10.0))
    )
    world = World(bounds=Bounds(east_m=(0.0, 16.0), north_m=(0.0, 10.0), up_m=(0.0, 3.0)), boxes=walls)
    starts_m = np.array([[2.0, middle_m, HEIGHT_M], [14.0, middle_m, HEIGHT_M]])
    return course("corridor", seed, world, starts_m, starts_m[::-1])


FLEETS: dict[str, Callable[[int], Course]] = {
    "swap": swap,
    "column of 4": column(4, room_world, "column of 4"),
    "column of 10": column(10, room_world, "column of 10"),
    "column of 10, forest": column(10, partial(forest_world, 50), "column of 10, forest"),
    "doorway": doorway,
    "corridor": corridor,
}
"""Courses of several vehicles by name."""
