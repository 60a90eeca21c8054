"""Our frames are pymavlink's frames, and what is no frame is dropped."""

import struct

import numpy as np
import pytest

from sitl.dialect import mavlink
from sitl.wire import LAYOUTS, FrameReader, FrameWriter, payload_of

KINDS = sorted(mavlink.mavlink_map.values(), key=lambda kind: kind.id)


def random_message(kind, rng: np.random.Generator):
    """A message with random content, some of it zero, so that trailing zeros are cut off as well."""
    values = []
    for name, field_type in zip(kind.fieldnames, kind.fieldtypes, strict=True):
        wire = kind.ordered_fieldnames.index(name)
        length = kind.array_lengths[wire]
        size = int(rng.integers(0, 2)) * 255
        if field_type == "char":
            text = bytes(rng.integers(65, 90, size=max(length, 1)).tolist())
            values.append(text[: int(rng.integers(0, max(length, 1) + 1))])
        elif length:
            values.append([int(value) for value in rng.integers(0, size // 3 + 1, size=length)])
        else:
            values.append(int(rng.integers(0, size // 3 + 1)))
    return kind(*values)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.msgname)
def test_our_packer_equals_pymavlinks_for_every_message(kind):
    rng = np.random.default_rng(kind.id)
    writer, codec = FrameWriter(7, 1), mavlink.MAVLink(None, 7, 1)
    for _ in range(4):
        message = random_message(kind, rng)
        expected = message.pack(codec)
        codec.seq = (codec.seq + 1) % 256
        assert writer.encode(message) == expected


def test_extension_fields_travel():
    frame = FrameWriter(1, 1).frame(LAYOUTS["MISSION_CURRENT"], (3, 10, 0, 0, 0xDEADBEEF, 2, 1))
    (message,) = FrameReader().read(frame)
    assert (message.seq, message.mission_id, message.fence_id, message.rally_points_id) == (3, 0xDEADBEEF, 2, 1)


def test_several_frames_in_one_datagram_are_all_read():
    writer = FrameWriter(1, 1)
    datagram = b"".join(writer.frame(LAYOUTS["ATTITUDE"], (i, 0, 0, 0, 0, 0, 0)) for i in range(3))
    assert [message.time_boot_ms for message in FrameReader().read(datagram)] == [0, 1, 2]


def test_a_frame_that_is_cut_off_does_not_eat_the_next_datagram():
    frame = FrameWriter(1, 1).frame(LAYOUTS["ATTITUDE"], (1, 2, 3, 4, 5, 6, 7))
    reader = FrameReader()
    assert reader.read(frame[:20]) == []
    assert len(reader.read(frame)) == 1
    assert reader.dropped == 1


@pytest.mark.parametrize("damage", ["crc", "garbage", "empty", "unknown id"])
def test_what_is_no_frame_is_counted_and_dropped(damage):
    frame = bytearray(FrameWriter(1, 1).frame(LAYOUTS["HEARTBEAT"], (2, 12, 0, 0, 0, 3)))
    if damage == "crc":
        frame[-1] ^= 0xFF
    elif damage == "garbage":
        frame = bytearray(b"GET / HTTP/1.1\r\n\r\n")
    elif damage == "empty":
        frame = bytearray()
    else:
        frame[7:10] = (0xFFFFF0).to_bytes(3, "little")
    reader = FrameReader()
    assert reader.read(bytes(frame)) == []
    assert reader.dropped == (0 if damage == "empty" else 1)


def test_the_payload_of_a_received_message_keeps_every_bit():
    signalling_nan = struct.pack("<I", 0x7F800001)
    codec = mavlink.MAVLink(None, 255, 190)
    frame = bytearray(mavlink.MAVLink_param_set_message(1, 1, b"NAME", 1.0, 6).pack(codec))
    frame[10:14] = signalling_nan
    crc = mavlink.x25crc(frame[1:-2])
    crc.accumulate(bytes([mavlink.MAVLink_param_set_message.crc_extra]))
    frame[-2:] = struct.pack("<H", crc.crc)
    (message,) = FrameReader().read(bytes(frame))
    assert payload_of(message, 4) == signalling_nan
