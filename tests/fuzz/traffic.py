"""Datagrams that nobody should send: well-formed frames with any content, damaged ones, and noise."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from gcs.dialect import mavlink

SPECIAL_FLOATS = (math.nan, math.inf, -math.inf, 0.0, -0.0, 1e38, -1e38, 1e-45)
INTEGER_BITS = {"uint8_t": (0, 8), "int8_t": (-1, 8), "uint16_t": (0, 16), "int16_t": (-1, 16)} | {
    "uint32_t": (0, 32),
    "int32_t": (-1, 32),
    "uint64_t": (0, 64),
    "int64_t": (-1, 64),
    "char": (0, 8),
}
SENDERS = ((1, 1), (1, 191), (2, 1), (255, 190), (254, 190), (0, 0), (250, 250))


class Traffic:
    """An endless supply of datagrams.

    Args:
        rng: decides everything.
        favoured: messages that the target reads, which come more often.
    """

    def __init__(self, rng: np.random.Generator, favoured: Sequence[str] = ()) -> None:
        self._rng = rng
        self._kinds: list[Any] = list(mavlink.mavlink_map.values())
        self._favoured = [kind for kind in self._kinds if kind.msgname in set(favoured)] or self._kinds
        self._senders = {ids: mavlink.MAVLink(None, *ids) for ids in SENDERS}
        self._before: list[bytes] = []

    def datagram(self) -> bytes:
        """One datagram."""
        makers: tuple[Callable[[], bytes], ...] = (self._frame, self._frame, self._frame, self._damaged, self._noise)
        made = makers[self._rng.integers(len(makers))]()
        share = self._rng.random()
        if share < 0.05:
            made = made[: self._rng.integers(len(made) + 1)]
        elif share < 0.1:
            made += self._frame()
        elif share < 0.15 and self._before:
            made = self._before[self._rng.integers(len(self._before))]  # a replay
        self._before = [*self._before[-50:], made]
        return made

    def _frame(self) -> bytes:
        kinds = self._favoured if self._rng.random() < 0.7 else self._kinds
        kind = kinds[self._rng.integers(len(kinds))]
        fields = zip(kind.fieldnames, kind.fieldtypes, strict=True)
        lengths = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
        values = [self._value(name, kind_of, lengths[name]) for name, kind_of in fields]
        sender = self._senders[SENDERS[self._rng.integers(len(SENDERS))]]
        sender.seq = int(self._rng.integers(256))
        return bytes(kind(*values).pack(sender, force_mavlink1=self._rng.random() < 0.03 and kind.id < 256))

    def _value(self, name: str, kind: str, length: int) -> Any:
        if kind == "char":
            return bytes(self._rng.integers(0, 256, max(length, 1), dtype=np.uint8))
        if length:
            return [self._number(name, kind) for _ in range(length)]
        return self._number(name, kind)

    def _number(self, name: str, kind: str) -> float | int:
        rng = self._rng
        if kind in ("float", "double"):
            return (
                SPECIAL_FLOATS[rng.integers(len(SPECIAL_FLOATS))] if rng.random() < 0.3 else float(rng.normal(0, 100))
            )
        if rng.random() < 0.6 and name in ("target_system", "target_component", "mission_type", "seq", "count", "type"):
            return int(rng.choice([0, 1, 2, 3, 190, 191, 255]))
        negative, bits = INTEGER_BITS.get(kind, (0, 8))
        low, high = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if negative else (0, 2**bits - 1)
        if rng.random() < 0.3:
            return int((low, high, 0, 1)[rng.integers(4)])
        return low + int(rng.random() * (high - low))

    def _damaged(self) -> bytes:
        frame = bytearray(self._frame())
        for _ in range(int(self._rng.integers(1, 6))):
            frame[self._rng.integers(len(frame))] ^= int(self._rng.integers(1, 256))
        return bytes(frame)

    def _noise(self) -> bytes:
        noise = self._rng.bytes(int(self._rng.integers(0, 600)))
        return b"\xfd" + noise if self._rng.random() < 0.5 else noise
