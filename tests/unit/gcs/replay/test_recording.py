"""Recordings: everything that is whole is read, whatever has happened to the file."""

from pathlib import Path

import numpy as np
import pytest

from gcs.errors import RecordingError
from gcs.link.tlog import TlogWriter
from gcs.replay.recording import parse_recording, read_recording
from gcs.replay.scan import frame_length, message_id, scan
from gcs.replay.ways import Ways
from tests.recordings import read_tlog
from tests.unit.gcs.replay.flights import BEGAN_US, flight, heartbeat, parsed, position, record
from tests.unit.gcs.security.frames import frame


def test_a_whole_recording_is_read_record_by_record(tmp_path: Path):
    path = tmp_path / "flight.tlog"
    path.write_bytes(flight())
    recording = read_recording(path)
    expected = list(read_tlog(path))
    assert [recording.frame(i) for i in range(len(recording))] == [sent for _, sent in expected]
    np.testing.assert_allclose(recording.times_s * 1e6 + BEGAN_US, [stamp for stamp, _ in expected], atol=1.0)
    assert (recording.skipped_bytes, recording.duration_s, recording.began_unix_us) == (0, 60.0, BEGAN_US)


def test_what_the_station_writes_is_read_back_signed_frames_too(tmp_path: Path):
    writer = TlogWriter(tmp_path / "flight.tlog")
    for sent in (frame(), frame(None), frame(None, v1=True)):
        writer.write(sent, BEGAN_US)
    writer.close()
    recording = read_recording(tmp_path / "flight.tlog")
    assert [recording.frame(i) for i in range(3)] == [frame(), frame(None), frame(None, v1=True)]
    assert [message.get_type() for _, message in recording.messages(range(3))] == ["HEARTBEAT"] * 3


def test_a_torn_end_is_left_out_and_counted():
    whole = flight(5.0)
    torn = parsed(whole + record(6.0, heartbeat())[:-3])
    assert (len(torn), torn.skipped_bytes) == (len(parsed(whole)), len(record(6.0, heartbeat())) - 3)


@pytest.mark.parametrize("seed", range(20))
def test_damage_costs_the_records_that_it_hits_and_no_others(seed: int):
    rng = np.random.default_rng(seed)
    data = flight(10.0)
    whole = parsed(data)
    at, size = int(rng.integers(100, len(data) - 400)), int(rng.integers(1, 60))
    spoilt = data[:at] + rng.bytes(size) + data[at + size :]
    read = parsed(spoilt)
    hit = (whole.starts + whole.lengths > at) & (whole.starts < at + size)
    untouched = {whole.frame(i) for i in np.flatnonzero(~hit)}
    assert untouched <= {read.frame(i) for i in range(len(read))}
    assert len(whole) - len(read) <= hit.sum()


@pytest.mark.parametrize("removed", [1, 7, 8, 9, 100])
def test_missing_bytes_cost_one_record_or_two(removed: int):
    data = flight(10.0)
    assert len(parsed(data)) - len(parsed(data[:500] + data[500 + removed :])) <= 2 + removed // 20


def test_random_bytes_hold_no_recording():
    data = np.frombuffer(np.random.default_rng(1).bytes(100_000), np.uint8)
    assert len(parse_recording(data)) <= 3  # a message that nobody knows has no checksum to be wrong


def test_the_compiled_scanner_equals_its_python():
    data = np.frombuffer(flight(2.0)[:-5] + b"\xfd\xfe" * 20, np.uint8)
    extras = np.full(500, -1, np.int64)
    tables = []
    for function in (scan, scan.py_func):
        starts, lengths = np.zeros(2000, np.int64), np.zeros(2000, np.int64)
        with np.errstate(over="ignore"):
            found = function(data, extras, starts, lengths)
        tables.append((found, starts.tolist(), lengths.tolist()))
    assert tables[0] == tables[1]
    starts = np.array(tables[0][1][: tables[0][0]])
    assert all(frame_length(data, s) == frame_length.py_func(data, s) for s in starts)
    assert all(message_id(data, s) == message_id.py_func(data.astype(int), s) for s in starts)


def test_a_damaged_stamp_does_not_stop_the_clock():
    records = [record(float(t), heartbeat()) for t in range(10)]
    records[5] = b"\x7f" + records[5][1:]
    recording = parsed(b"".join(records))
    assert recording.duration_s == 9.0
    assert (np.diff(recording.times_s) >= 0.0).all()


def test_a_clock_that_is_set_back_does_not_turn_time_back():
    records = [record(t, heartbeat()) for t in (100.0, 101.0, 0.0, 1.0)]
    assert parsed(b"".join(records)).times_s.tolist() == [0.0, 1.0, 1.0, 2.0]


@pytest.mark.parametrize("data", [b"", b"nothing of the kind", b"\xfd" * 1000])
def test_a_file_without_a_whole_record_is_refused(tmp_path: Path, data: bytes):
    (tmp_path / "x.tlog").write_bytes(data)
    with pytest.raises(RecordingError, match=r"x.tlog: expected a MAVLink recording"):
        read_recording(tmp_path / "x.tlog")


def test_a_missing_file_is_refused(tmp_path: Path):
    with pytest.raises(RecordingError, match="No such file"):
        read_recording(tmp_path / "none.tlog")


def test_ways_are_what_the_vehicles_said():
    ways = Ways(parsed(flight(12.0))).by_sysid
    assert ways.keys() == {1, 2}
    assert len(ways[1].records) == 121
    np.testing.assert_allclose(ways[1].times_s, np.arange(121) / 10)
    np.testing.assert_allclose(ways[2].geodetic[50], [47.3977 + 5e-5, 8.5456, 495.0])
    np.testing.assert_allclose(ways[2].velocities_m_s[50], [0.22, 1.11, 0.33])


def test_places_that_are_none_are_no_way():
    empty = record(0.0, position(0.0))
    nowhere = record(1.0, type(position(0.0))(0, 0, 0, 0, 0, 0, 0, 0, 0))
    assert len(Ways(parsed(empty + nowhere)).by_sysid[1].records) == 1
