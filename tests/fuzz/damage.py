"""Well-formed bytes, damaged: what files and texts become on bad disks, in editors, and in the hands of an attacker."""

from collections.abc import Callable, Sequence

import numpy as np

TOKENS = (
    b"NaN Infinity -Infinity 1e999 -1e999 1e-999 -0 -1 0 1 255 256 65535 65536 2147483647 2147483648 -2147483649 "
    b'9223372036854775808 99999999999999999999 0x10 1_000 null true false {} [] "" \' \\ , : ; # \t \n \r\n \0 '
    b"\xff\xfe \xef\xbb\xbf \xf0\x9f\x9b\xb0 \xd9\xa3 &amp; &x; <!DOCTYPE x> <![CDATA[ ]]> </kml> %s ../../x"
).split(b" ") + [b"9" * 5000, b"[" * 3000, b"<a>" * 3000, b'{"a":' * 2000, b"1e" + b"9" * 400]
MOST_BYTES = 200_000


class Damage:
    """An endless supply of damaged samples.

    Args:
        rng: decides everything.
        samples: well-formed ones.
    """

    def __init__(self, rng: np.random.Generator, samples: Sequence[bytes]) -> None:
        self._rng, self._samples = rng, list(samples)
        self._ways: tuple[Callable[[bytearray], None], ...] = (
            self._flip,
            self._cut,
            self._insert,
            self._repeat,
            self._replace_number,
            self._replace_number,
            self._replace_number,
            self._splice,
        )

    def sample(self) -> bytes:
        """One sample with a few damages, now and then none, now and then nothing but noise."""
        if self._rng.random() < 0.02:
            return self._rng.bytes(int(self._rng.integers(0, 400)))
        data = bytearray(self._samples[self._rng.integers(len(self._samples))])
        for _ in range(int(self._rng.integers(0, 5))):
            if data:
                self._ways[self._rng.integers(len(self._ways))](data)
        return bytes(data[:MOST_BYTES])

    def _at(self, data: bytearray) -> int:
        return int(self._rng.integers(len(data)))

    def _token(self) -> bytes:
        return TOKENS[self._rng.integers(len(TOKENS))]

    def _flip(self, data: bytearray) -> None:
        for _ in range(int(self._rng.integers(1, 6))):
            data[self._at(data)] ^= 1 << int(self._rng.integers(8))

    def _cut(self, data: bytearray) -> None:
        at = self._at(data)
        del data[at : at + int(self._rng.choice([1, 7, 60, len(data)]))]

    def _insert(self, data: bytearray) -> None:
        at = self._at(data)
        data[at:at] = self._token()

    def _repeat(self, data: bytearray) -> None:
        at = self._at(data)
        data[at:at] = data[at : at + int(self._rng.integers(1, 200))] * int(self._rng.choice([1, 2, 50]))

    def _replace_number(self, data: bytearray) -> None:
        """A number of a text by something else."""
        digits = np.flatnonzero((np.frombuffer(data, np.uint8) - 48) < 10)
        if not len(digits):
            return
        begin = int(digits[self._rng.integers(len(digits))])
        end = begin
        while end < len(data) and data[end : end + 1] in b"0123456789.eE+-":
            end += 1
        data[begin:end] = self._token()

    def _splice(self, data: bytearray) -> None:
        other = self._samples[self._rng.integers(len(self._samples))]
        data[self._at(data) :] = other[int(self._rng.integers(len(other) + 1)) :]
