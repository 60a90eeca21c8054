"""Keys and timestamps of the signed ground links in a folder, one file per vehicle, so that no frame counts twice.

A timestamp is written a second ahead of the one that was accepted or sent, and again only when that second is used up:
whenever the program is killed, the file is past all that has been accepted, at one write a second.
"""

import contextlib
import os
from dataclasses import replace
from pathlib import Path

import msgspec

from sitl.autopilot.memory import Memory, SigningMemory
from sitl.errors import BadSigningFile
from sitl.microservices.signing import KEY_BYTES, TICKS_PER_S

AHEAD = TICKS_PER_S


class _Stream(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The last timestamp of one sender."""

    system: int
    component: int
    link: int
    timestamp: int


class _Stored(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One file."""

    key: str
    """Hexadecimal; empty for none."""
    timestamp: int
    streams: tuple[_Stream, ...]


class SigningFiles:
    """Reads what was signed before a simulation, and keeps what is signed in it.

    Args:
        folder: where the files are; it must be there.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._written: dict[int, SigningMemory] = {}

    def path(self, sysid: int) -> Path:
        return self._folder / f"vehicle-{sysid}.signing"

    def load(self, sysid: int) -> SigningMemory:
        """What a vehicle has stored; nothing if there is no file.

        Raises:
            BadSigningFile: it is none of ours.
            OSError: it cannot be read.
        """
        memory = SigningMemory()
        with contextlib.suppress(FileNotFoundError):
            memory = self._decoded(self.path(sysid))
        self._written[sysid] = _copy(memory)
        return memory

    def save(self, memories: dict[int, Memory]) -> None:
        """Write the files of the vehicles whose signing has outrun them; a file is whole at every moment."""
        for sysid, memory in memories.items():
            signing, written = memory.signing, self._written.get(sysid)
            if signing.key is None and written is None:
                continue
            if written is None or not _covers(written, signing):
                self._written[sysid] = ahead = _ahead(signing)
                self._write(sysid, ahead)

    def _decoded(self, path: Path) -> SigningMemory:
        try:
            stored = msgspec.json.decode(path.read_bytes(), type=_Stored)
            key = bytes.fromhex(stored.key)
        except (msgspec.DecodeError, ValueError):
            raise BadSigningFile(path) from None
        if len(key) not in (0, KEY_BYTES):
            raise BadSigningFile(path)
        streams = {(s.system, s.component, s.link): s.timestamp for s in stored.streams}
        return SigningMemory(key or None, stored.timestamp, streams)

    def _write(self, sysid: int, memory: SigningMemory) -> None:
        streams = tuple(_Stream(*stream, timestamp) for stream, timestamp in memory.streams.items())
        stored = _Stored((memory.key or b"").hex(), memory.timestamp, streams)
        draft = self.path(sysid).with_suffix(".signing-draft")
        draft.touch(mode=0o600)  # there is a key in it
        draft.write_bytes(msgspec.json.encode(stored))
        os.replace(draft, self.path(sysid))


def _covers(written: SigningMemory, now: SigningMemory) -> bool:
    """Whether nothing has been accepted or sent past what is written."""
    known = written.key == now.key and now.timestamp <= written.timestamp
    return known and all(time <= written.streams.get(stream, -1) for stream, time in now.streams.items())


def _ahead(memory: SigningMemory) -> SigningMemory:
    streams = {stream: timestamp + AHEAD for stream, timestamp in memory.streams.items()}
    return SigningMemory(memory.key, memory.timestamp + AHEAD, streams)


def _copy(memory: SigningMemory) -> SigningMemory:
    return replace(memory, streams=dict(memory.streams))
