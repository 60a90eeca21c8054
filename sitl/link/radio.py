"""The air between companions: what one says all others hear, through the faults of the way between the two. Sans-IO.

A fault is of a vehicle's radio. Between two vehicles the worse of their two radios counts, figure by figure; what
happens to a datagram on its way to one of them does not depend on what happens to it on its way to another.
"""

from collections.abc import Iterable

import msgspec
import numpy as np

from missions.faults import LinkConditions
from missions.mission import LinkSettings
from sitl.link.faulty_link import PERFECT, Direction, FaultyLink


class FleetRadio:
    """All radios of a fleet.

    Args:
        settings: what the mission makes of them.
        sysids: who has one.
        seed: decides what is lost and how long the rest takes.
    """

    def __init__(self, settings: LinkSettings, sysids: Iterable[int], seed: int) -> None:
        self._settings = settings
        self._seed = seed
        self._ends: dict[int, LinkConditions] = dict.fromkeys(sysids, settings)
        self._black_until_s: dict[int, float] = {}
        self._ways: dict[tuple[int, int], FaultyLink] = {}
        """Between two vehicles, the smaller system id first; made when the first of them speaks."""
        self._out: list[tuple[int, bytes]] = []

    def change(self, sysid: int, conditions: LinkConditions, black_until_s: float) -> None:
        """One vehicle's radio becomes like this; what is on its way stays as it is."""
        self._ends[sysid], self._black_until_s[sysid] = conditions, black_until_s
        for pair, way in self._ways.items():
            if sysid in pair:
                self._adapt(pair, way)

    def send(self, sysid: int, datagram: bytes, now_s: float, since_takeoff_s: float | None) -> None:
        """A companion speaks; whoever is no vehicle of the fleet has no radio."""
        if sysid not in self._ends:
            return
        for other in self._ends:
            if other != sysid:
                way = self._way(*sorted((sysid, other)))
                if way.is_perfect(now_s):
                    self._out.append((other, datagram))
                else:
                    way.send(_direction(sysid, other), datagram, now_s, since_takeoff_s)

    def arrived(self, now_s: float) -> list[tuple[int, bytes]]:
        """What has been heard since the last call: (system id of who hears it, one datagram), in order."""
        out, self._out = self._out, []
        for (low, high), way in self._ways.items():
            if not way.is_perfect(now_s):
                out.extend((low, datagram) for datagram in way.arrived(_direction(high, low), now_s))
                out.extend((high, datagram) for datagram in way.arrived(_direction(low, high), now_s))
        return out

    def _way(self, low: int, high: int) -> FaultyLink:
        way = self._ways.get((low, high))
        if way is None:
            rng = np.random.default_rng([self._seed, *b"fleet", low, high])
            way = self._ways[low, high] = FaultyLink(self._settings, rng)
            self._adapt((low, high), way)
        return way

    def _adapt(self, pair: tuple[int, int], way: FaultyLink) -> None:
        way.change(_worse(*(self._ends[sysid] for sysid in pair)))
        way.black_out(max(self._black_until_s.get(sysid, 0.0) for sysid in pair))


def _direction(sender: int, receiver: int) -> Direction:
    return Direction.UP if sender < receiver else Direction.DOWN


def _worse(one: LinkConditions, other: LinkConditions) -> LinkConditions:
    """The worse of two radios, figure by figure; the narrower band, of those that have a limit."""
    names = LinkConditions.__struct_fields__
    worst = msgspec.structs.replace(PERFECT, **{name: max(getattr(one, name), getattr(other, name)) for name in names})
    limits = [end.bandwidth_bytes_s for end in (one, other) if end.bandwidth_bytes_s > 0.0]
    return msgspec.structs.replace(worst, bandwidth_bytes_s=min(limits, default=0.0))
