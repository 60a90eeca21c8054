"""The file behind `--signing-key`."""

from collections.abc import Iterable
from pathlib import Path

from sitl.errors import BadSigningKey

KEY_BYTES = 32


def load_signing_keys(path: Path, sysids: Iterable[int]) -> dict[int, bytes]:
    """System id -> key.

    The file has one line of 64 hexadecimal digits for all vehicles, or lines of a system id and such a key.

    Raises:
        BadSigningKey: a line is neither.
        OSError: the file cannot be read.
    """
    lines = [line.split() for line in path.read_text(encoding="utf-8", errors="replace").splitlines()]
    numbered = [(number, words) for number, words in enumerate(lines, start=1) if words]
    if len(numbered) == 1 and len(numbered[0][1]) == 1:
        number, (text,) = numbered[0]
        return dict.fromkeys(sysids, _key(path, number, text))
    if not numbered:
        raise BadSigningKey(path, 1)
    return dict(_line(path, number, words) for number, words in numbered)


def _line(path: Path, number: int, words: list[str]) -> tuple[int, bytes]:
    if len(words) != 2 or not words[0].isdecimal():
        raise BadSigningKey(path, number)
    return int(words[0]), _key(path, number, words[1])


def _key(path: Path, number: int, text: str) -> bytes:
    try:
        key = bytes.fromhex(text)
    except ValueError:
        raise BadSigningKey(path, number) from None
    if len(key) != KEY_BYTES or not any(key):
        raise BadSigningKey(path, number)
    return key
