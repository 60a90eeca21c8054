"""`gcs replay`: the page on a recording, with the same panels and scene as in flight, and nothing to command."""

import asyncio
from dataclasses import dataclass, field

from gcs.app import Page
from gcs.desk import Desk
from gcs.flight.events import EventLog
from gcs.flight.journal import Story
from gcs.flight.rejoining import told_flight
from gcs.flight.told import Told
from gcs.flight.trails import Trail, Trails
from gcs.replay.player import Player
from gcs.replay.ways import Way, Ways
from gcs.station import Station
from missions.frames import LocalFrame

STEP_S = 0.05


@dataclass
class ReplayStation(Station):
    """A station without links: its clock is that of a recording."""

    player: Player | None = None

    @property
    def now_s(self) -> float:
        return self.player.position_s if self.player is not None else 0.0


@dataclass
class ReplaySession:
    """One recording on one desk.

    Args:
        player: with the recording.
        told: what happened, by the ground station's log or the vehicles' own words.
        story: mission and plan, where they are known.
    """

    player: Player
    told: Told
    story: Story | None = None
    desk: Desk = field(init=False)

    def __post_init__(self) -> None:
        self._ways = Ways(self.player.recording)
        station = ReplayStation(fleet=self.player.fleet, player=self.player)
        events = EventLog(lambda: self.player.position_s)
        self.flight = told_flight(self.story, station, events) if self.story is not None else None
        self.desk = Desk(station, events, self.flight, player=self.player)
        self.player.on_seek.append(self._renew)
        self._renew()

    async def run(self, page: Page) -> None:
        """Serve the page until cancelled, and play as it says."""
        async with asyncio.TaskGroup() as group:
            group.create_task(self._play(), name="play")
            await page(self.desk, asyncio.Event())

    def step(self, now_s: float) -> None:
        """Play on to where a steadily rising clock is."""
        self.player.advance(now_s)
        self._show()
        if self.desk.trails is not None:
            self.desk.trails.sample(self.player.fleet, self._offsets_m())

    async def _play(self) -> None:
        while True:
            self.step(asyncio.get_running_loop().time())
            await asyncio.sleep(STEP_S)

    def _renew(self) -> None:
        """After a jump: trails as they were at that moment."""
        self._show()
        self.desk.trails = self._trails()

    def _show(self) -> None:
        self.desk.station.fleet = self.player.fleet
        self.desk.events.events[:] = self.told.until(self.player.position_s)

    def _trails(self) -> Trails | None:
        frame = self._frame()
        if frame is None:
            return None
        count, offsets_m = self.player.recording.count_until(self.player.position_s), self._offsets_m()
        ways = self._ways.by_sysid.items()
        return Trails(frame, {sysid: _trail(way, frame, count, offsets_m.get(sysid, 0.0)) for sysid, way in ways})

    def _frame(self) -> LocalFrame | None:
        if self.flight is not None:
            return self.flight.mission.frame
        place = self._ways.first_place()
        return LocalFrame(place) if place is not None else None

    def _offsets_m(self) -> dict[int, float]:
        parts = self.flight.vehicles if self.flight is not None else {}
        return {sysid: part.monitor.ground_offset_m for sysid, part in parts.items()}


def _trail(way: Way, frame: LocalFrame, count: int, ground_offset_m: float) -> Trail:
    """What was written of a way before record `count`."""
    seen = int((way.records < count).sum())
    positions_m = way.positions_m(frame, ground_offset_m)[:seen]
    return Trail.of(way.times_s[:seen], positions_m, way.velocities_m_s[:seen])
