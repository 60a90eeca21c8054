"""Vehicles that talk over a bad link, in virtual time: their exchanges, and nothing else of them."""

import heapq
import itertools
from dataclasses import dataclass, field

import numpy as np

from companion.fleet.exchange import Exchange
from companion.fleet.reports import PositionReport, Report
from missions.mission import Mission, load_mission
from missions.trajectory import Trajectory, at_rest

ROOM: Mission = load_mission("fleet-10")
TICK_S = 0.02
BEGIN_S = 1_700_000_000.0
"""UTC when all begins."""


def line(start_m: tuple[float, float, float], end_m: tuple[float, float, float], at_s: float, lasts_s: float = 4.0):
    """A straight trajectory from rest to rest."""
    ends = np.array(start_m, dtype=float), np.array(end_m, dtype=float)
    inner = np.linspace(*ends, 8)[1:-1]
    return Trajectory(np.vstack(([ends[0]] * 3, inner, [ends[1]] * 3)), at_s, lasts_s / 9)


@dataclass
class Air:
    """Everybody's exchange, and the air between them.

    Args:
        n: vehicles.
        loss: share of messages that do not arrive.
        delay_s: of each message.
        jitter_s: each takes up to this much longer, and may be overtaken.
        duplicates: share of messages that come twice.
        clock_errors_s: of each vehicle's UTC.
        seed: of all this.
    """

    n: int = 2
    loss: float = 0.0
    delay_s: float = 0.0
    jitter_s: float = 0.0
    duplicates: float = 0.0
    clock_errors_s: tuple[float, ...] = ()
    seed: int = 0
    now_s: float = 0.0
    flying: list[tuple[float, int, int, Report]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.seed)
        self._count = itertools.count()
        self.boots_s = [100.0 * number for number in range(1, self.n + 1)]
        """Vehicle time when all begins: no two vehicles' clocks agree."""
        self.exchanges = [Exchange(number, ROOM) for number in range(1, self.n + 1)]
        errors = self.clock_errors_s or (0.0,) * self.n
        for exchange, boot_s, error_s in zip(self.exchanges, self.boots_s, errors, strict=True):
            exchange.utc_ahead_s = BEGIN_S + error_s - boot_s
        self.places = [np.array([2.0, 1.0 + 2.0 * number, 1.5]) for number in range(self.n)]
        self.paths: dict[int, Trajectory] = {}
        """What vehicles really fly; the others hover in their places."""

    def time_s(self, number: int) -> float:
        """A vehicle's own time."""
        return self.boots_s[number] + self.now_s

    def tick(self) -> None:
        """Let 20 ms pass: hear what has arrived, say what is due."""
        self.now_s += TICK_S
        while self.flying and self.flying[0][0] <= self.now_s:
            _, _, receiver, report = heapq.heappop(self.flying)
            self.exchanges[receiver].hear(report, self.time_s(receiver))
        for number, exchange in enumerate(self.exchanges):
            for report in exchange.tick(self.place(number), self.time_s(number)):
                self.spread(number, report)

    def run(self, duration_s: float) -> None:
        for _ in range(round(duration_s / TICK_S)):
            self.tick()

    def place(self, number: int) -> PositionReport:
        utc_s = self.time_s(number) + (self.exchanges[number].utc_ahead_s or 0.0)
        moves = self.paths.get(number, at_rest(self.places[number], 0.0)).at(self.time_s(number))
        return PositionReport(number + 1, utc_s, moves.position_m, moves.velocity_m_s, 0.05, on_ground=False)

    def spread(self, sender: int, report: Report) -> None:
        """A report is on its way to everybody else."""
        for receiver in range(self.n):
            copies = 1 + int(self._rng.random() < self.duplicates)
            for _ in range(copies if receiver != sender else 0):
                if self._rng.random() >= self.loss:
                    arrives_s = self.now_s + self.delay_s + self.jitter_s * self._rng.random()
                    heapq.heappush(self.flying, (arrives_s, next(self._count), receiver, report))
