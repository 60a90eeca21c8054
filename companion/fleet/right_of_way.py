"""Who makes way when vehicles block each other: at doors, in corridors, head-on.

A vehicle that finds no path for a while tells the others which one it wants. Whoever is in the way of it and has the
larger system id, or is at its target and idle, makes way: it goes aside, back where it came from if need be, and goes
on when the other one has passed. Who is blocked while making way wants a path itself, with the rank of whom it makes
way for, so that a row of vehicles backs up as one. The smallest system id that wants something is never asked to make
way on its way, so that somebody always comes through; it is idle at its target, and makes way there.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from companion.fleet.roster import Said
from missions.trajectory import Trajectory

Array = npt.NDArray[np.float64]

PATIENCE_S = 1.0
"""Without a path for so long, a vehicle wants one ..."""
LONGER_PATIENCE_S = 4.0
"""... and later if it has just made way for somebody."""
SAME_PLACE_M = 0.5
"""Who has come this far is not stuck any more."""
FORGET_S = 3.0
"""Nor is who has found a path for so long."""
CALM_S = 1.5
"""Whoever has made way goes on when the other one has wanted nothing for so long."""
SAMPLES = 24


@dataclass(frozen=True)
class Claim:
    """The path that another vehicle wants.

    Args:
        sysid: of that vehicle.
        rank: of whom it wants it for.
        path_m: (m, 3) ENU.
    """

    sysid: int
    rank: int
    path_m: Array

    def distance_m(self, points_m: Array) -> Array:
        """(n,) distances of (n, 3) points from the path [m]."""
        return np.linalg.norm(points_m[:, None] - self.path_m[None], axis=2).min(axis=1)


class RightOfWay:
    """One vehicle among others that block it, or that it blocks.

    Args:
        sysid: of this vehicle: its rank while it flies for itself.
    """

    def __init__(self, sysid: int) -> None:
        self._sysid = sysid
        self.claim: Claim | None = None
        """Whom it makes way for."""
        self._claimed_s = float("-inf")
        self._stuck_m: Array | None = None
        self._stuck_since_s = self._no_path_s = float("-inf")

    @property
    def rank(self) -> int:
        """The smaller goes first."""
        return self._sysid if self.claim is None else min(self.claim.rank, self._sysid)

    def note_no_path(self, place_m: Array, now_s: float) -> None:
        """No path was found from a (3,) place."""
        elsewhere = self._stuck_m is None or np.linalg.norm(place_m - self._stuck_m) > SAME_PLACE_M
        if elsewhere or now_s - self._no_path_s > FORGET_S:
            self._stuck_m, self._stuck_since_s = place_m, now_s
        self._no_path_s = now_s

    def is_stuck(self, now_s: float) -> bool:
        """It has found no path for so long that it wants one."""
        recently = now_s - self._claimed_s < LONGER_PATIENCE_S and self.claim is None
        patience_s = LONGER_PATIENCE_S if recently else PATIENCE_S
        return now_s - self._no_path_s < FORGET_S and now_s - self._stuck_since_s > patience_s

    def look(
        self, wanted: Iterable[tuple[int, Said]], flown: Trajectory, distance_m: float, now_s: float, *, idle: bool
    ) -> None:
        """Notice who wants this vehicle out of its way, and when that is over.

        Args:
            wanted: system ids, and the paths that they want.
            flown: this vehicle's trajectory.
            distance_m: what is nearer to a path is in its way.
            now_s: vehicle time.
            idle: this vehicle wants nothing itself.
        """
        own_m = flown.sample(np.linspace(max(now_s, flown.start_s), max(now_s, flown.end_s), SAMPLES)).position_m
        claims = sorted(_claims(wanted), key=lambda claim: (claim.rank, claim.sysid))
        for claim in claims:
            known = self.claim is not None and claim.sysid == self.claim.sysid
            before = idle or (claim.rank, claim.sysid) < (self._sysid, self._sysid)
            if known or (before and claim.distance_m(own_m).min() < distance_m):
                self.claim, self._claimed_s = claim, now_s
                return
        if now_s - self._claimed_s > CALM_S:
            self.claim = None


def _claims(wanted: Iterable[tuple[int, Said]]) -> Iterable[Claim]:
    for sysid, said in wanted:
        times_s = np.linspace(said.trajectory.start_s, said.trajectory.end_s, SAMPLES)
        yield Claim(sysid, said.message.rank or sysid, said.trajectory.sample(times_s).position_m)


def places_aside(claim: Claim, here_m: Array, trail_m: Array, distance_m: float) -> Array:
    """(n, 3) places out of a claim's way, the nearest first: around a (3,) place, and back along a (k, 3) trail."""
    angles = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    ring = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(len(angles))))
    around_m = [here_m + radius_m * ring for radius_m in distance_m * np.array([0.6, 1.0, 1.5, 2.2, 3.2, 4.5, 6.0])]
    places_m = np.vstack((*around_m, trail_m.reshape(-1, 3)))
    places_m = places_m[claim.distance_m(places_m) > distance_m]
    return places_m[np.argsort(np.linalg.norm(places_m - here_m, axis=1), kind="stable")]
