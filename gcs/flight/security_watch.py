"""Tells the operator how far each vehicle can be trusted, and of frames that were refused."""

from dataclasses import dataclass, field

from gcs.flight.events import EventLog, Severity
from gcs.security.signing import Refusal, Signing, Trust
from gcs.station import Station

TELL_INTERVAL_S = 10.0
"""The same refusal is told this often at most."""

_WORDS = {
    Trust.UNSIGNED: "UNSIGNED: anybody on the link can speak as this vehicle (`gcs key install` gives it a key)",
    Trust.PENDING: "KEY PENDING: it has not signed with its new key yet",
    Trust.SIGNED: "SIGNED: every frame is verified",
}


@dataclass
class SecurityWatch:
    """Compares what the links refused and heard with what was told of it.

    Args:
        station: the links.
        events: where it is told.
        names: of the vehicles, by system id.
    """

    station: Station
    events: EventLog
    names: dict[int, str] = field(default_factory=dict[int, str])
    _trust: dict[int, Trust] = field(default_factory=dict[int, Trust])
    _told: dict[tuple[int, Refusal], tuple[int, float]] = field(
        default_factory=dict[tuple[int, Refusal], tuple[int, float]]
    )

    def look(self, now_s: float) -> None:
        """Tell what is new since the last call."""
        signing = self.station.codec.signing
        for sysid in self.station.fleet.vehicles:
            self._tell_trust(sysid, signing.trust(sysid))
        self._tell_refusals(signing, now_s)

    def _tell_trust(self, sysid: int, trust: Trust) -> None:
        if self._trust.get(sysid) is not trust:
            self._trust[sysid] = trust
            severity = Severity.INFO if trust is Trust.SIGNED else Severity.WARNING
            self.events.add("security", _WORDS[trust], self._name(sysid), severity, trust=trust.value)

    def _tell_refusals(self, signing: Signing, now_s: float) -> None:
        for (sysid, refusal), count in list(signing.refused.items()):
            told, told_s = self._told.get((sysid, refusal), (0, -TELL_INTERVAL_S))
            if count > told and now_s - told_s >= TELL_INTERVAL_S:
                self._told[sysid, refusal] = count, now_s
                frames = "a frame was dropped" if count - told == 1 else f"{count - told} frames were dropped"
                text = f"{frames} in its name: what came {refusal.value}"
                self.events.add("security", text, self._name(sysid), Severity.WARNING, refused=count)

    def _name(self, sysid: int) -> str:
        return self.names.get(sysid, f"vehicle {sysid}")
