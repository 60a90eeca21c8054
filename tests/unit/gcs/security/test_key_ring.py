"""Key rings: keys that nobody else may read, and that are whole at every moment."""

import os
from pathlib import Path

import pytest

from gcs.errors import KeyRingError
from gcs.link.codec import Codec
from gcs.security.key_ring import KEYS, PENDING, TIMESTAMPS, KeyRing
from gcs.security.signing import RESERVE, VehicleKey
from sitl.signing_keys import load_signing_keys
from tests.unit.gcs.security.frames import KEY, NOW, NOW_UNIX_US, OTHER_KEY, frame


def write(path: Path, text: str) -> None:
    path.parent.mkdir(exist_ok=True)
    path.touch(mode=0o600)
    path.write_text(text)


def test_a_ring_that_is_not_there_is_empty(tmp_path: Path):
    assert KeyRing(tmp_path / "none").load() == {}
    assert not (tmp_path / "none").exists()


def test_what_is_saved_is_loaded(tmp_path: Path):
    vehicles = {1: VehicleKey(KEY, OTHER_KEY, 12, {(1, 0): 7, (191, 0): 9}), 9: VehicleKey(None, KEY)}
    KeyRing(tmp_path / "ring").save(vehicles)
    assert KeyRing(tmp_path / "ring").load() == vehicles


def test_files_and_folder_are_for_the_owner_alone(tmp_path: Path):
    ring = KeyRing(tmp_path / "ring")
    ring.save({1: VehicleKey(KEY, OTHER_KEY)})
    assert ring.folder.stat().st_mode & 0o777 == 0o700
    assert {name: (ring.folder / name).stat().st_mode & 0o777 for name in os.listdir(ring.folder)} == {
        KEYS: 0o600,
        PENDING: 0o600,
        TIMESTAMPS: 0o600,
    }


def test_keys_that_others_may_read_are_refused(tmp_path: Path):
    ring = KeyRing(tmp_path / "ring")
    ring.ensure([1])
    ring.keys_path.chmod(0o644)
    with pytest.raises(KeyRingError, match="others may read it"):
        ring.load()


def test_missing_keys_are_made_once_and_are_what_the_simulator_reads(tmp_path: Path):
    ring = KeyRing(tmp_path / "ring")
    ring.ensure([1, 2])
    made = ring.load()
    ring.ensure([1, 2, 3])
    assert {sysid: ring.load()[sysid].key for sysid in (1, 2)} == {1: made[1].key, 2: made[2].key}
    assert load_signing_keys(ring.keys_path, [1, 2, 3]) == {sysid: v.key for sysid, v in ring.load().items()}
    assert made[1].key != made[2].key


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        (KEYS, "1 abc\n", r"keys:1: expected a system id and 64"),
        (KEYS, f"0 {KEY.hex()}\n", r"keys:1: expected"),
        (KEYS, f"300 {KEY.hex()}\n", r"keys:1: expected"),
        (KEYS, f"1 {'0' * 64}\n", r"keys:1: expected"),
        (KEYS, f"1 {KEY.hex()}\n1 {OTHER_KEY.hex()}\n", r"keys:2: a second key for vehicle 1"),
        (KEYS, "\xff\n", r"keys:1"),
        (TIMESTAMPS, "{", r"timestamps.json: .*rotate the keys"),
        (TIMESTAMPS, '{"x": {"fingerprint": "", "timestamp": 0, "streams": []}}', r"timestamps.json"),
        (TIMESTAMPS, '{"1": {"fingerprint": "", "timestamp": -1, "streams": []}}', r"48 bits of timestamp, found -1"),
    ],
)
def test_a_damaged_ring_is_refused_with_place_and_reason(tmp_path: Path, name: str, text: str, says: str):
    write(tmp_path / "ring" / name, text)
    with pytest.raises(KeyRingError, match=says):
        KeyRing(tmp_path / "ring").load()


def test_a_replay_is_refused_after_a_restart(tmp_path: Path):
    ring = KeyRing(tmp_path / "ring")
    ring.save({1: VehicleKey(KEY)})
    sent = frame()
    assert len(Codec(signing=ring.signing(lambda: NOW_UNIX_US)).parse(sent)) == 1
    restarted = Codec(signing=KeyRing(ring.folder).signing(lambda: NOW_UNIX_US))
    assert restarted.parse(sent) == []
    assert len(restarted.parse(frame(KEY, NOW + RESERVE + 1))) == 1


def test_a_vehicle_is_heard_although_its_timestamps_cannot_be_kept(tmp_path: Path):
    ring, said = KeyRing(tmp_path / "ring"), []
    ring.save({1: VehicleKey(KEY)})
    codec = Codec(signing=ring.signing(lambda: NOW_UNIX_US, said.append))
    ring.folder.rename(tmp_path / "elsewhere")
    ring.folder.touch()  # nothing can be written into it
    for late in range(3):
        assert len(codec.parse(frame(KEY, NOW + late * (RESERVE + 1)))) == 1
    assert codec.parse(frame()) == []  # a replay is one as before
    (text,) = said
    assert "keys cannot be written: " in text
    assert "may take old frames for new" in text


def test_timestamps_of_another_key_do_not_bind_a_new_one(tmp_path: Path):
    ring = KeyRing(tmp_path / "ring")
    ring.save({1: VehicleKey(KEY, None, NOW, {(1, 0): NOW})})
    write(ring.keys_path, f"1 {OTHER_KEY.hex()}\n")
    loaded = ring.load()[1]
    assert (loaded.key, loaded.timestamp, loaded.streams) == (OTHER_KEY, NOW, {})
