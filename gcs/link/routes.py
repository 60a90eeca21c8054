"""Which systems are heard over which paths, who else is on the links, and which frames are to be believed."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from gcs.dialect import AUTOPILOT, Message, mavlink
from gcs.link.connection import Address, Connection
from gcs.link.paths import LIVE_S, LinkQuality, Path, SystemPaths

Way = tuple[Connection, Address]

CHOICE_INTERVAL_S = 0.25
MOST_NAMED = 32
"""Other ground stations and rivals that are told of."""


@dataclass
class Routes:
    """All systems and the ways to them.

    Args:
        own: our system and component id.
        say: takes a sentence for the operator.
    """

    own: tuple[int, int]
    say: Callable[[str], None]
    ignored: int = 0
    """Messages of a second vehicle with a system id that is taken, or of nobody."""
    _systems: dict[int, SystemPaths[Way]] = field(default_factory=dict[int, SystemPaths[Way]])
    _chosen_s: dict[int, float] = field(default_factory=dict[int, float])
    _named: set[tuple[object, ...]] = field(default_factory=set[tuple[object, ...]])

    def heard(self, message: Message, way: Way, now_s: float) -> bool:
        """Take note of where a message came from; whether it is to be believed."""
        sysid, component = message.get_srcSystem(), message.get_srcComponent()
        if (sysid, component) == self.own:
            self._meet_namesake(way, now_s)
            return False
        if sysid == 0:
            self.ignored += 1
            return False
        system = self._systems.get(sysid)
        if system is None:
            system = self._systems[sysid] = SystemPaths()
        path = system.path(way)
        kind = message.get_type()
        path.heard_s = now_s
        if component == AUTOPILOT:
            path.hear(message.get_seq(), now_s)
            self._learn(path, message, kind, now_s)
        if system.chosen is None or len(system.paths) > 1:
            self._choose(sysid, system, now_s)
            if way in system.rivals(now_s):
                self.ignored += 1
                self._name_once(
                    ("rival", sysid, way),
                    f"vehicle {sysid} is heard from {_at(system.chosen)} and from {_at(way)}: two vehicles, "
                    "give one of them another system id",
                )
                return False
            if component == AUTOPILOT and system.is_stranger(way, now_s):
                self.ignored += 1
                return False
        if kind == "HEARTBEAT" and message.type == mavlink.MAV_TYPE_GCS:
            what = f"another ground station, {sysid}/{component}, is on the link ({_at(way)})"
            self._name_once(("gcs", sysid, component), what)
        return True

    def best(self, sysid: int, now_s: float) -> Way | None:
        """Where a system is to be sent to; None if it was never heard."""
        system = self._systems.get(sysid)
        if system is None:
            return None
        if len(system.paths) > 1:
            self._choose(sysid, system, now_s)
        return system.chosen

    def rivals(self, sysid: int, now_s: float) -> list[Way]:
        """Ways over which another vehicle with the same system id is heard."""
        system = self._systems.get(sysid)
        return system.rivals(now_s) if system is not None else []

    def quality(self, sysid: int, now_s: float) -> LinkQuality | None:
        way, system = self.best(sysid, now_s), self._systems.get(sysid)
        return system.paths[way].quality(now_s) if system is not None and way is not None else None

    def qualities(self, sysid: int, now_s: float) -> dict[Way, LinkQuality]:
        """Of all ways to a system."""
        system = self._systems.get(sysid)
        return {way: path.quality(now_s) for way, path in system.paths.items()} if system is not None else {}

    def live_paths(self, sysid: int, now_s: float) -> list[tuple[Way, Path]]:
        """The ways over which a system is heard now."""
        system = self._systems.get(sysid)
        paths = system.paths if system is not None else {}
        return [(way, path) for way, path in paths.items() if now_s - path.heard_s <= LIVE_S]

    def live_ways(self, now_s: float) -> list[tuple[int, Way]]:
        """System id and way of everybody who is heard; the best way also of those who are silent."""
        return list(self._live_ways(now_s))

    def _live_ways(self, now_s: float) -> Iterator[tuple[int, Way]]:
        for sysid, system in self._systems.items():
            for way, path in system.paths.items():
                if way == system.chosen or now_s - path.heard_s <= LIVE_S:
                    yield sysid, way

    def _learn(self, path: Path, message: Message, kind: str, now_s: float) -> None:
        if kind == "TIMESYNC":
            if message.tc1 != 0:
                path.pong(message.ts1, now_s)
        elif kind == "AUTOPILOT_VERSION":
            path.hardware_id = int.from_bytes(bytes(message.uid2), "little") or message.uid
        elif (boot_ms := getattr(message, "time_boot_ms", None)) is not None:
            path.boot_clock_s = boot_ms * 1e-3 - now_s

    def _choose(self, sysid: int, system: SystemPaths[Way], now_s: float) -> None:
        if system.chosen is not None and now_s - self._chosen_s.get(sysid, -1.0) < CHOICE_INTERVAL_S:
            return
        before, self._chosen_s[sysid] = system.chosen, now_s
        chosen = system.choose(now_s)
        if before is not None and chosen != before:
            self.say(f"vehicle {sysid} is reached by {_at(chosen)} now, and was by {_at(before)}")

    def _meet_namesake(self, way: Way, now_s: float) -> None:
        """Our own ids from somewhere that no vehicle is: another ground station uses them."""
        if not any(way in system.paths for system in self._systems.values()):
            what = f"somebody at {_at(way)} uses this ground station's ids {self.own[0]}/{self.own[1]}"
            self._name_once(("namesake", way), what)

    def _name_once(self, what: tuple[object, ...], text: str) -> None:
        if what not in self._named and len(self._named) < MOST_NAMED:
            self._named.add(what)
            self.say(text)


def _at(way: Way | None) -> str:
    return f"{way[1][0]}:{way[1][1]}" if way is not None else "nowhere"
