"""Datagrams, connection strings and recordings."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gcs.dialect import mavlink
from gcs.errors import UsageError
from gcs.link.codec import Codec
from gcs.link.tlog import TlogWriter
from gcs.link.url import LinkUrl, Scheme, parse_link_url
from tests.recordings import read_tlog
from tests.unit.gcs.messages import frame_of

HEARTBEAT = mavlink.MAVLink_heartbeat_message(2, 12, 81, 0, 3, 3)


def test_both_grammars_of_connection_strings_mean_the_same():
    expected = LinkUrl(Scheme.UDP_IN, "0.0.0.0", 14550)
    assert parse_link_url("udpin:0.0.0.0:14550") == parse_link_url("udpin://0.0.0.0:14550") == expected
    assert parse_link_url("udpout://10.0.0.7:14550").scheme is Scheme.UDP_OUT


def test_without_a_host_a_link_stays_on_loopback():
    assert parse_link_url("udpin://:14550").host == "127.0.0.1"


@pytest.mark.parametrize(
    "text", ["", "14550", "ftp://h:1", "udpin://h", "udpin://h:0", "udpin://h:99999", "udpin://h:x"]
)
def test_a_link_that_cannot_be_is_refused_with_what_could(text: str):
    with pytest.raises(UsageError, match="udpin://HOST:PORT"):
        parse_link_url(text)


def test_several_messages_in_one_datagram_all_arrive():
    codec = Codec()
    datagram = b"".join(frame_of(1, 1, HEARTBEAT, seq) for seq in range(3))
    assert [message.get_seq() for message in codec.parse(datagram)] == [0, 1, 2]


def test_a_torn_frame_does_not_eat_the_next_datagram():
    codec = Codec()
    frame = frame_of(1, 1, HEARTBEAT)
    assert codec.parse(frame[:-4]) == []
    assert len(codec.parse(frame)) == 1
    assert codec.malformed == 1


def test_a_damaged_frame_is_counted_and_dropped():
    codec = Codec()
    frame = bytearray(frame_of(1, 1, HEARTBEAT))
    frame[12] ^= 0xFF
    assert codec.parse(bytes(frame)) == []
    assert codec.malformed == 1


def test_mavlink_1_is_not_spoken():
    codec = Codec()
    frame = HEARTBEAT.pack(mavlink.MAVLink(None, 1, 1), force_mavlink1=True)
    assert codec.parse(bytes(frame)) == []
    assert codec.malformed == 1


@given(data=st.binary(max_size=400))
def test_random_bytes_never_raise(data: bytes):
    codec = Codec()
    codec.parse(data)
    assert len(codec.parse(frame_of(1, 1, HEARTBEAT))) == 1


@given(data=st.binary(max_size=255), at=st.integers(0, 300))
def test_random_bytes_behind_a_header_never_raise(data: bytes, at: int):
    frame = bytearray(frame_of(1, 1, HEARTBEAT))
    Codec().parse(bytes(frame[: at % len(frame)]) + data)


def test_losses_are_counted_from_sequence_numbers():
    codec = Codec()
    for seq in (250, 251, 254, 255, 0, 2, 1):  # 252 and 253 are lost, 1 is overtaken by 2
        codec.parse(frame_of(1, 1, HEARTBEAT, seq))
    count = codec.sources[1, 1]
    assert (count.received, count.lost) == (7, 2)


def test_unknown_messages_count_for_the_link_and_reach_nobody():
    codec = Codec()
    mystery = bytearray([0xFD, 1, 0, 0, 5, 1, 1, 0xF0, 0xFF, 0x0F, 42, 0, 0])
    assert codec.parse(bytes(mystery)) == []
    assert codec.sources[1, 1].received == 1
    assert codec.malformed == 0


def test_own_frames_carry_the_station_and_count_up():
    codec = Codec()
    frames = [codec.pack(HEARTBEAT) for _ in range(257)]
    assert (frames[0][0], frames[0][5], frames[0][6]) == (0xFD, 255, 190)
    assert [frame[4] for frame in (frames[0], frames[255], frames[256])] == [0, 255, 0]


def test_a_recording_reads_back_and_a_torn_end_is_left_out(tmp_path: Path):
    path = tmp_path / "flight.tlog"
    writer = TlogWriter(path)
    frames = [frame_of(1, 1, HEARTBEAT, seq) for seq in range(3)]
    for index, frame in enumerate(frames):
        writer.write(frame, 1_700_000_000_000_000 + index)
    writer.close()
    assert [frame for _, frame in read_tlog(path)] == frames
    assert next(read_tlog(path))[0] == 1_700_000_000_000_000
    path.write_bytes(path.read_bytes()[:-3])
    assert len(list(read_tlog(path))) == 2
