"""A vehicle with a key signs what it sends to the ground, and obeys nothing that is not signed with it."""

import hashlib
import struct
from pathlib import Path

import pytest

from sitl.autopilot.memory import SigningMemory
from sitl.dialect import mavlink
from sitl.errors import BadSigningKey
from sitl.microservices.outbox import Link, Sender
from sitl.microservices.signing import EPOCH_UNIX_S, MOST_STREAMS, Signing
from sitl.signing_keys import load_signing_keys
from sitl.simulator import UTC_START_US
from sitl.wire import FrameReader
from tests.unit.sitl.flown import COMPANION, GCS, Flown

KEY, OTHER_KEY = bytes(range(32)), bytes(range(1, 33))
BOOT = (UTC_START_US - EPOCH_UNIX_S * 1_000_000) // 10
"""The time of boot as a timestamp."""
SENDER = Sender(Link.GROUND, *GCS)
CHECK = mavlink.MAVLink_command_long_message(1, 1, 401, 0, *[0.0] * 7)


def signer(key: bytes, timestamp: int, *, link_id: int = 7, who: tuple[int, int] = GCS):
    """pymavlink's signing end of a link."""
    codec = mavlink.MAVLink(None, *who)
    codec.signing.secret_key, codec.signing.sign_outgoing = key, True
    codec.signing.timestamp, codec.signing.link_id = timestamp, link_id
    return codec


def keyed() -> tuple[Flown, mavlink.MAVLink]:
    """A vehicle that has been given its key by an unsigned SETUP_SIGNING, and a ground station that has it."""
    flown = Flown().boot()
    flown.send(mavlink.MAVLink_setup_signing_message(1, 1, list(KEY), BOOT))
    flown.run(0.1)
    flown.forget()
    return flown, signer(KEY, BOOT + 200_000)


def obeys(flown: Flown, frame: bytes, link: Link = Link.GROUND) -> bool:
    before = len(flown.messages("COMMAND_ACK", link=link))
    flown.simulator.receive(1, link, frame)
    flown.run(0.04)
    return len(flown.messages("COMMAND_ACK", link=link)) > before


def verified(frame: bytes, key: bytes) -> bool:
    return bool(frame[2] & 1) and frame[-6:] == hashlib.sha256(key + frame[:-6]).digest()[:6]


# --------------------------------------------------------------------- sending
def test_what_goes_to_the_ground_is_signed_and_what_goes_to_the_companion_is_not():
    flown, _ = keyed()
    flown.run(2.0)
    assert all(verified(frame, KEY) for frame in flown.heard(Link.GROUND))
    assert not any(frame[2] & 1 for frame in flown.heard(Link.ONBOARD))


def test_timestamps_rise_by_every_frame_and_are_the_time():
    flown, _ = keyed()
    flown.run(2.0)
    stamps = [int.from_bytes(frame[-12:-6], "little") for frame in flown.heard(Link.GROUND)]
    assert len(set(stamps)) == len(stamps)
    assert stamps == sorted(stamps)
    assert stamps[-1] == pytest.approx(BOOT + flown.time_s * 1e5, abs=5000)


def test_on_a_fast_simulation_timestamps_are_those_of_the_wall_clock():
    memory = SigningMemory(KEY)
    frame = Signing(memory, UTC_START_US, 10.0).sign(CHECK.pack(mavlink.MAVLink(None, 1, 1)), 600.0)
    assert int.from_bytes(frame[-12:-6], "little") == BOOT + 60 * 100_000


def test_pymavlink_accepts_what_we_sign():
    frame = Signing(SigningMemory(KEY), UTC_START_US, 1.0).sign(CHECK.pack(mavlink.MAVLink(None, 1, 1)), 1.0)
    ground = mavlink.MAVLink(None)
    ground.signing.secret_key = KEY
    ground.signing.timestamp = BOOT
    (message,) = ground.parse_buffer(frame)
    assert message.get_signed()


def test_what_the_companion_says_is_signed_on_its_way_to_the_ground():
    flown, _ = keyed()
    flown.send(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3), link=Link.ONBOARD)
    (frame,) = [frame for frame in flown.heard(Link.GROUND) if frame[6] == COMPANION[1]]
    assert verified(frame, KEY)
    assert FrameReader().read(frame)[0].type == 18


# ------------------------------------------------------------------- receiving
def test_without_a_key_unsigned_and_signed_frames_are_obeyed():
    flown = Flown().boot()
    assert obeys(flown, CHECK.pack(mavlink.MAVLink(None, *GCS)))
    assert obeys(flown, CHECK.pack(signer(KEY, BOOT)))


def test_with_a_key_only_signed_frames_are_obeyed_on_the_ground_link():
    flown, ground = keyed()
    unsigned = CHECK.pack(mavlink.MAVLink(None, *GCS))
    assert not obeys(flown, unsigned)
    assert not obeys(flown, CHECK.pack(signer(OTHER_KEY, BOOT + 300_000)))
    assert not obeys(flown, CHECK.pack(mavlink.MAVLink(None, *GCS), force_mavlink1=True))
    assert flown.simulator.vehicles[1].dropped == 3
    assert obeys(flown, CHECK.pack(ground))
    assert obeys(flown, CHECK.pack(mavlink.MAVLink(None, *COMPANION)), Link.ONBOARD)


def test_one_changed_bit_is_one_too_many():
    frame = bytearray(CHECK.pack(signer(KEY, BOOT)))
    signing = Signing(SigningMemory(KEY), UTC_START_US, 1.0)
    for position in range(len(frame)):
        changed = bytearray(frame)
        changed[position] ^= 1
        assert not signing.accepts(bytes(changed), SENDER, 1.0), position
    assert signing.accepts(bytes(frame), SENDER, 1.0)


def test_a_frame_counts_once_and_none_that_is_older():
    flown, ground = keyed()
    first, second = CHECK.pack(ground), CHECK.pack(ground)
    assert obeys(flown, second)
    assert not obeys(flown, second)
    assert not obeys(flown, first)


def test_a_forged_frame_from_the_future_does_not_silence_the_real_sender():
    flown, ground = keyed()
    assert not obeys(flown, CHECK.pack(signer(OTHER_KEY, 2**47)))
    assert obeys(flown, CHECK.pack(ground))


def test_a_new_stream_may_lag_a_minute_and_no_more():
    signing = Signing(SigningMemory(KEY), UTC_START_US, 1.0)
    late, too_late = BOOT + 40 * 100_000, BOOT + 39 * 100_000
    assert not signing.accepts(CHECK.pack(signer(KEY, too_late)), SENDER, 100.0)
    assert signing.accepts(CHECK.pack(signer(KEY, late)), SENDER, 100.0)


def test_the_table_of_streams_is_bounded():
    memory = SigningMemory(KEY)
    signing = Signing(memory, UTC_START_US, 1.0)
    accepted = [
        signing.accepts(CHECK.pack(signer(KEY, BOOT + i, link_id=i)), SENDER, 1.0) for i in range(3 * MOST_STREAMS)
    ]
    assert accepted == [True] * MOST_STREAMS + [False] * 2 * MOST_STREAMS
    assert len(memory.streams) == MOST_STREAMS


def test_signed_frames_reach_the_companion_without_their_signature():
    flown, ground = keyed()
    flown.send(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3), link=Link.ONBOARD)
    order = mavlink.MAVLink_command_long_message(1, 191, 300, 0, *[0.0] * 7)
    flown.simulator.receive(1, Link.GROUND, order.pack(ground))
    flown.run(0.02)
    (there,) = flown.messages("COMMAND_LONG", link=Link.ONBOARD)
    plain = mavlink.MAVLink(None, *GCS)
    plain.seq = there.get_seq()
    assert bytes(there.get_msgbuf()) == order.pack(plain)


# ------------------------------------------------------------------------ keys
def test_a_key_is_changed_and_given_up_only_by_who_has_it():
    flown, ground = keyed()
    plain = mavlink.MAVLink(None, *GCS)
    flown.simulator.receive(1, Link.GROUND, mavlink.MAVLink_setup_signing_message(1, 1, [0] * 32, 0).pack(plain))
    assert not obeys(flown, CHECK.pack(plain))
    setup = mavlink.MAVLink_setup_signing_message(1, 1, list(OTHER_KEY), BOOT)
    flown.simulator.receive(1, Link.GROUND, setup.pack(ground))
    assert not obeys(flown, CHECK.pack(ground))
    ground.signing.secret_key = OTHER_KEY
    assert obeys(flown, CHECK.pack(ground))
    end = mavlink.MAVLink_setup_signing_message(1, 1, [0] * 32, 0)
    flown.simulator.receive(1, Link.GROUND, end.pack(ground))
    assert obeys(flown, CHECK.pack(plain))


def test_companions_neither_set_nor_see_keys():
    flown = Flown().boot()
    flown.send(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3), link=Link.ONBOARD)
    setup = mavlink.MAVLink_setup_signing_message(1, 1, list(KEY), BOOT)
    flown.send(setup, link=Link.ONBOARD)
    assert obeys(flown, CHECK.pack(mavlink.MAVLink(None, *GCS)))
    flown.send(mavlink.MAVLink_setup_signing_message(1, 0, list(KEY), BOOT))
    assert not flown.messages("SETUP_SIGNING", link=Link.ONBOARD)


def test_a_reboot_forgets_neither_the_key_nor_what_was_seen():
    flown, ground = keyed()
    seen, reboot = CHECK.pack(ground), mavlink.MAVLink_command_long_message(1, 1, 246, 0, 1, *[0.0] * 6).pack(ground)
    assert obeys(flown, seen)
    flown.simulator.receive(1, Link.GROUND, reboot)
    flown.run(3.0)
    assert flown.last("ATTITUDE").time_boot_ms < 3000
    assert not obeys(flown, seen)
    assert not obeys(flown, CHECK.pack(mavlink.MAVLink(None, *GCS)))
    assert obeys(flown, CHECK.pack(ground))


def test_key_files_have_one_key_for_all_or_one_for_each(tmp_path: Path):
    path = tmp_path / "keys"
    path.write_text(f"{KEY.hex()}\n")
    assert load_signing_keys(path, [1, 2]) == {1: KEY, 2: KEY}
    path.write_text(f"1 {KEY.hex()}\n\n2 {OTHER_KEY.hex()}\n")
    assert load_signing_keys(path, [1, 2, 3]) == {1: KEY, 2: OTHER_KEY}


@pytest.mark.parametrize("text", ["", "secret", KEY.hex()[:-2], "0" * 64, f"one {KEY.hex()}", f"1 {KEY.hex()} 2"])
def test_a_bad_key_file_is_named_and_its_content_is_not_shown(tmp_path: Path, text):
    path = tmp_path / "keys"
    path.write_text(text)
    with pytest.raises(BadSigningKey, match=r"keys:1: expected 64 hexadecimal digits") as refused:
        load_signing_keys(path, [1])
    assert text[:10] not in str(refused.value) or not text


def test_the_signature_is_that_of_the_specification():
    """SHA-256 over key, header, payload, checksum, link id and 48 bits of timestamp; its first 48 bits."""
    frame = CHECK.pack(signer(KEY, BOOT, link_id=7))
    tail = struct.pack("<BQ", 7, BOOT)[:7]
    assert frame[-13:-6] == tail
    assert Signing(SigningMemory(KEY), UTC_START_US, 1.0).accepts(frame, SENDER, 0.0)
