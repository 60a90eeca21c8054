"""STATUSTEXT into lines: chunks put together, repetitions left out, floods held back. No clock: time is an argument."""

from dataclasses import dataclass, field

from gcs.dialect import Message, mavlink
from gcs.fleet.flood_gate import FloodGate

CHUNK_CHARACTERS = 50
"""A full chunk; a shorter one is the last of its text."""
MOST_CHUNKS = 16
CHUNKS_WAIT_S = 1.0
"""A text whose last chunk does not come is shown without it."""
SAME_WITHIN_S = 5.0
"""A text that is said again within so long is not shown again."""
MOST_PER_WINDOW, WINDOW_S = 20, 2.0
URGENT = mavlink.MAV_SEVERITY_CRITICAL
MOST_REMEMBERED = 64
MISSING = "[…]"
UNPRINTABLE = "\ufffd"


@dataclass(frozen=True)
class StatusText:
    """A line that the autopilot said."""

    time_s: float
    severity: int
    """MAV_SEVERITY: 0 emergency to 7 debug."""
    text: str


@dataclass
class _Chunks:
    begun_s: float
    severity: int
    parts: dict[int, str] = field(default_factory=dict[int, str])
    last: int | None = None

    @property
    def complete(self) -> bool:
        return self.last is not None and len(self.parts) == self.last + 1

    @property
    def text(self) -> str:
        end = max(self.parts) if self.last is None else self.last
        told = [self.parts.get(seq, MISSING) for seq in range(end + 1)] + [MISSING] * (self.last is None)
        return "".join(
            part for before, part in zip(["", *told], told, strict=False) if part != MISSING or before != part
        )


@dataclass
class StatusTexts:
    """What one autopilot says, as lines worth showing."""

    repeated: int = 0
    """Texts left out because they had just been shown."""
    _chunks: dict[int, _Chunks] = field(default_factory=dict[int, _Chunks])
    _shown_s: dict[tuple[int, str], float] = field(default_factory=dict[tuple[int, str], float])
    _gates: dict[bool, FloodGate] = field(
        default_factory=lambda: {urgent: FloodGate(MOST_PER_WINDOW, WINDOW_S) for urgent in (True, False)}
    )
    """Chatter must not keep an emergency from being shown."""

    @property
    def held_back(self) -> int:
        """Texts left out because there were too many at once."""
        return sum(gate.held_back for gate in self._gates.values())

    def receive(self, message: Message, now_s: float) -> list[StatusText]:
        """The lines that are complete with this message."""
        lines = self.overdue(now_s)
        if message.id == 0:
            return lines + self._show(message.severity, message.text, now_s)
        if message.chunk_seq >= MOST_CHUNKS:
            return lines
        if message.id not in self._chunks and len(self._chunks) >= MOST_CHUNKS:
            del self._chunks[next(iter(self._chunks))]
        chunks = self._chunks.setdefault(message.id, _Chunks(now_s, message.severity))
        chunks.parts[message.chunk_seq] = message.text
        if len(message.text) < CHUNK_CHARACTERS:
            chunks.last = max(message.chunk_seq, *chunks.parts)
        return lines + (self._finish(message.id, now_s) if chunks.complete else [])

    def overdue(self, now_s: float) -> list[StatusText]:
        """Texts whose missing chunks are no longer waited for."""
        late = [number for number, chunks in self._chunks.items() if now_s - chunks.begun_s > CHUNKS_WAIT_S]
        return [line for number in late for line in self._finish(number, now_s)]

    def _finish(self, number: int, now_s: float) -> list[StatusText]:
        chunks = self._chunks.pop(number)
        return self._show(chunks.severity, chunks.text, now_s)

    def _show(self, severity: int, text: str, now_s: float) -> list[StatusText]:
        said = (severity, printable(text.rstrip("\t\x00 ")))
        before_s = self._shown_s.pop(said, None)
        self._shown_s[said] = now_s
        while len(self._shown_s) > MOST_REMEMBERED:
            del self._shown_s[next(iter(self._shown_s))]
        if before_s is not None and now_s - before_s < SAME_WITHIN_S:
            self.repeated += 1
            return []
        return [StatusText(now_s, *said)] if self._gates[severity <= URGENT].admits(now_s) else []


def printable(text: str) -> str:
    """What may be shown of a text from outside: what would steer a terminal or turn the writing around is replaced."""
    return "".join(character if character.isprintable() else UNPRINTABLE for character in text)
