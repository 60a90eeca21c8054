"""What is uploaded, and over which links: the same in virtual time, over real sockets, and to a fleet."""

import numpy as np

from missions.mission_items import MissionItem

ONE_WAY_DELAY_S = 0.05
LOSSES = (0.0, 0.1, 0.3, 0.5)
"""Shares of frames that get lost, the same both ways."""
ITEMS = (10, 100, 1000)
_, USUAL_ITEMS, MANY_ITEMS = ITEMS


def waypoints(n: int, rng: np.random.Generator) -> list[MissionItem]:
    """A mission of `n` items that differ in everything that is flown."""
    places = rng.integers(-10_000, 10_000, (n, 2))
    heights = rng.uniform(480.0, 520.0, n).astype(np.float32)
    return [
        MissionItem(command=16, param2=0.5, x=473_977_418 + int(e), y=85_455_939 + int(n_), z=float(h))
        for (e, n_), h in zip(places, heights, strict=True)
    ]
