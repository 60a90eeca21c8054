"""Keys and timestamps of signed vehicles in a folder: what must survive the ground station, and nobody else may read.

`keys` has one line per vehicle, system id and 64 hexadecimal digits, the form that `sitl --signing-key` reads;
`pending` has the same for keys that a vehicle has not signed with yet; `timestamps.json` is what has been used of them.
Files are made with mode 0600 and replaced as a whole.
"""

import contextlib
import os
import re
import secrets
from collections.abc import Callable, Iterable
from hashlib import sha256
from pathlib import Path

import msgspec

from gcs.errors import KeyRingError
from gcs.security.signing import KEY_BYTES, LATEST_TICK, Signing, VehicleKey
from gcs.unwritten import unheard

KEYS, PENDING, TIMESTAMPS = "keys", "pending", "timestamps.json"
MOST_BYTES = 1 << 20
_LINE = re.compile(r"^(?P<sysid>[1-9]\d{0,2})\s+(?P<key>[0-9a-fA-F]{64})$")


class _Stream(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The last timestamp of one sender with a vehicle's system id."""

    component: int
    link: int
    timestamp: int


class _Used(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What has been used of one vehicle's key."""

    fingerprint: str
    timestamp: int
    streams: tuple[_Stream, ...]


class KeyRing:
    """The keys in one folder.

    Args:
        folder: made, with mode 0700, when the first key is stored.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @property
    def keys_path(self) -> Path:
        return self.folder / KEYS

    def load(self) -> dict[int, VehicleKey]:
        """All vehicles with a key, by system id; empty where there is no folder.

        Raises:
            KeyRingError: a file is not what it should be, or may be read by others.
        """
        active, pending, used = self._read_keys(KEYS), self._read_keys(PENDING), self._read_used()
        vehicles: dict[int, VehicleKey] = {}
        for sysid in sorted(active.keys() | pending.keys()):
            vehicle = vehicles[sysid] = VehicleKey(active.get(sysid), pending.get(sysid))
            stored = used.get(sysid)
            if stored is not None:
                vehicle.timestamp = stored.timestamp
            if stored is not None and vehicle.key is not None and stored.fingerprint == fingerprint(vehicle.key):
                vehicle.streams = {(s.component, s.link): s.timestamp for s in stored.streams}
        return vehicles

    def save(self, vehicles: dict[int, VehicleKey]) -> None:
        """Write keys and what has been used of them; each file is whole at every moment.

        Raises:
            KeyRingError: the folder or a file cannot be written.
        """
        active = {sysid: v.key for sysid, v in vehicles.items() if v.key is not None}
        pending = {sysid: v.next_key for sysid, v in vehicles.items() if v.next_key is not None}
        used = {
            str(sysid): _Used(
                fingerprint(v.key) if v.key is not None else "",
                v.timestamp,
                tuple(_Stream(component, link, time) for (component, link), time in v.streams.items()),
            )
            for sysid, v in vehicles.items()
        }
        try:
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._write(TIMESTAMPS, msgspec.json.encode(used))
            self._write_keys(KEYS, active)  # before `pending`: a key that has taken over is never in neither
            self._write_keys(PENDING, pending)
        except OSError as problem:
            raise KeyRingError(f"{self.folder}: keys cannot be written: {problem.strerror}") from None

    def signing(self, unix_us: Callable[[], int], say: Callable[[str], None] = unheard) -> Signing:
        """Signing with the keys of this ring, which keeps itself in it.

        Where that fails, on a full disk, the vehicles are heard all the same: not to hear them is the greater danger.

        Args:
            unix_us: the wall clock.
            say: takes a sentence when what was used of the keys can be kept no longer.

        Raises:
            KeyRingError: see `load`.
        """
        told: list[str] = []

        def keep(vehicles: dict[int, VehicleKey]) -> None:
            try:
                self.save(vehicles)
            except KeyRingError as problem:
                if not told:
                    told.append(str(problem))
                    say(f"{problem}: a ground station that is started after this one may take old frames for new")

        return Signing(self.load(), unix_us, keep)

    def ensure(self, sysids: Iterable[int]) -> None:
        """Make the keys that are missing and put them into force at once, for vehicles that will be given them.

        Raises:
            KeyRingError: see `load` and `save`.
        """
        vehicles = self.load()
        missing = [sysid for sysid in sysids if sysid not in vehicles or vehicles[sysid].key is None]
        for sysid in missing:
            vehicles[sysid] = VehicleKey(new_key())
        if missing:
            self.save(vehicles)

    def _read_keys(self, name: str) -> dict[int, bytes]:
        keys: dict[int, bytes] = {}
        for number, line in enumerate(self._read(name).decode(errors="replace").splitlines(), start=1):
            match = _LINE.match(line.strip())
            if match is None or not 1 <= int(match["sysid"]) <= 255 or not any(bytes.fromhex(match["key"])):
                raise KeyRingError(
                    f"{self.folder / name}:{number}: expected a system id and 64 hexadecimal digits, not all zero"
                )
            if int(match["sysid"]) in keys:
                raise KeyRingError(f"{self.folder / name}:{number}: a second key for vehicle {match['sysid']}")
            keys[int(match["sysid"])] = bytes.fromhex(match["key"])
        return keys

    def _read_used(self) -> dict[int, _Used]:
        text = self._read(TIMESTAMPS)
        try:
            used = msgspec.json.decode(text, type=dict[str, _Used]) if text else {}
            by_sysid = {int(sysid): entry for sysid, entry in used.items()}
        except (msgspec.DecodeError, msgspec.ValidationError, ValueError) as wrong:
            raise KeyRingError(
                f"{self.folder / TIMESTAMPS}: {wrong}: without it old frames would be taken for new; rotate the keys "
                "and remove it"
            ) from None
        for entry in by_sysid.values():
            for time in (entry.timestamp, *(stream.timestamp for stream in entry.streams)):
                if not 0 <= time <= LATEST_TICK:
                    raise KeyRingError(f"{self.folder / TIMESTAMPS}: expected 48 bits of timestamp, found {time}")
        return by_sysid

    def _read(self, name: str) -> bytes:
        path = self.folder / name
        try:
            with path.open("rb") as file:
                if os.fstat(file.fileno()).st_mode & 0o077:
                    raise KeyRingError(f"{path}: others may read it: expected mode 0600 (chmod 600 {path})")
                data = file.read(MOST_BYTES + 1)
        except FileNotFoundError:
            return b""
        except OSError as problem:
            raise KeyRingError(f"{path}: cannot be read: {problem.strerror}") from None
        if len(data) > MOST_BYTES:
            raise KeyRingError(f"{path}: expected at most {MOST_BYTES} bytes")
        return data

    def _write_keys(self, name: str, keys: dict[int, bytes]) -> None:
        if keys or (self.folder / name).exists():
            self._write(name, "".join(f"{sysid} {key.hex()}\n" for sysid, key in sorted(keys.items())).encode())

    def _write(self, name: str, data: bytes) -> None:
        path = self.folder / name
        draft = path.with_name(f"{name}-draft-{os.getpid()}")
        with contextlib.suppress(FileNotFoundError):
            draft.unlink()
        with os.fdopen(os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
            file.write(data)
        draft.replace(path)


def new_key() -> bytes:
    """32 bytes from the system's random generator."""
    return secrets.token_bytes(KEY_BYTES)


def fingerprint(key: bytes) -> str:
    """What may be shown of a key: eight hexadecimal digits of its hash."""
    return sha256(b"fingerprint" + key).hexdigest()[:8]
