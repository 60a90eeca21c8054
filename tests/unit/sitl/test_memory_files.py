"""Keys and timestamps outlast a simulation: what counted in one counts in none that follows."""

from pathlib import Path

import pytest

from sitl.autopilot.memory import Memory, SigningMemory
from sitl.autopilot.parameter_table import parameter_table
from sitl.dialect import mavlink
from sitl.dynamics.airframe import X500_LIKE
from sitl.errors import BadSigningFile
from sitl.link.memory_files import MemoryFiles
from sitl.link.signing_files import SigningFiles
from sitl.microservices.outbox import Link, Sender
from sitl.microservices.signing import EPOCH_UNIX_S, TICKS_PER_S, Signing
from sitl.simulator import UTC_START_US
from tests.unit.sitl.flown import GCS

KEY, OTHER_KEY = bytes(range(32)), bytes(range(1, 33))
SENDER = Sender(Link.GROUND, *GCS)
BOOT = (UTC_START_US - EPOCH_UNIX_S * 1_000_000) // 10
"""The time of boot as a timestamp."""


def files(folder: Path) -> MemoryFiles:
    return MemoryFiles(folder, parameter_table(X500_LIKE))


def frame_at(timestamp: int, key: bytes = KEY) -> bytes:
    """A frame of a ground station, signed."""
    codec = mavlink.MAVLink(None, *GCS)
    codec.signing.secret_key, codec.signing.sign_outgoing, codec.signing.timestamp = key, True, timestamp
    return mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(codec)


def accepts(memory: Memory, frame: bytes, now_s: float = 1.0) -> bool:
    return Signing(memory.signing, UTC_START_US, 1.0).accepts(frame, SENDER, now_s)


def test_a_frame_that_counted_before_the_program_was_killed_does_not_count_again(tmp_path):
    kept, memory = files(tmp_path), Memory(signing=SigningMemory(KEY))
    frame = frame_at(BOOT)
    assert accepts(memory, frame)
    kept.save({1: memory})
    late_frame = frame_at(BOOT + TICKS_PER_S // 2)
    assert accepts(memory, late_frame)
    following = files(tmp_path).load(1, {})
    assert following.signing.key == KEY
    assert not accepts(following, frame, 5.0)
    assert not accepts(following, late_frame, 5.0)
    assert accepts(following, frame_at(BOOT + 2 * TICKS_PER_S), 5.0)


def test_what_is_sent_next_is_newer_than_all_that_was_sent(tmp_path):
    memory = Memory(signing=SigningMemory(KEY, timestamp=BOOT + 10**9))
    files(tmp_path).save({1: memory})
    assert files(tmp_path).load(1, {}).signing.timestamp > memory.signing.timestamp


def test_one_write_a_second_is_enough(tmp_path, monkeypatch):
    kept, memory = SigningFiles(tmp_path), Memory(signing=SigningMemory(KEY))
    signing, writes = Signing(memory.signing, UTC_START_US, 1.0), []
    monkeypatch.setattr(kept, "_write", lambda sysid, ahead: writes.append(sysid))
    frame = mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3).pack(mavlink.MAVLink(None, 1, 1))
    for tick in range(500):
        signing.sign(frame, tick * 0.02)
        kept.save({1: memory})
    assert 10 <= len(writes) <= 11


def test_a_vehicle_that_never_had_a_key_has_no_file_and_one_that_gave_it_up_has_none_in_it(tmp_path):
    kept, memory = files(tmp_path), Memory()
    kept.save({1: memory})
    assert list(tmp_path.iterdir()) == []
    memory.signing.key = KEY
    kept.save({1: memory})
    (path,) = tmp_path.iterdir()
    assert path.stat().st_mode & 0o077 == 0, "others can read the key"
    memory.signing.key = None
    kept.save({1: memory})
    assert files(tmp_path).load(1, {}).signing.key is None


def test_a_key_of_the_command_line_beats_the_stored_one(tmp_path):
    files(tmp_path).save({1: Memory(signing=SigningMemory(KEY, 7, {(255, 190, 0): 7}))})
    same, other = (files(tmp_path).load(1, {1: key}).signing for key in (KEY, OTHER_KEY))
    assert (same.key, len(same.streams)) == (KEY, 1)
    assert (other.key, len(other.streams)) == (OTHER_KEY, 0)


@pytest.mark.parametrize(
    "content",
    [
        "",
        "{}",
        "no JSON",
        '{"key": "0102", "timestamp": 1, "streams": []}',
        '{"key": "", "timestamp": "1", "streams": []}',
    ],
)
def test_a_file_that_is_none_of_ours_is_named_and_not_shown(tmp_path, content):
    path = SigningFiles(tmp_path).path(2)
    path.write_text(content)
    with pytest.raises(BadSigningFile, match=f"^{path}: expected") as caught:
        SigningFiles(tmp_path).load(2)
    assert not content or content not in str(caught.value)
