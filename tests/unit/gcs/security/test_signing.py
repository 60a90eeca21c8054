"""Signing: what a vehicle with a key sends is verified before anything of it counts, and nothing counts twice."""

import hashlib

import pytest

from gcs.link.codec import Codec
from gcs.security.signing import MOST_STREAMS, OLDEST_NEW_STREAM, RESERVE, Refusal, Signing, Trust, VehicleKey
from tests.unit.gcs.security.frames import KEY, NOW, NOW_UNIX_US, OTHER_KEY, damaged, frame, heartbeat

KEPT: list[dict[int, VehicleKey]] = []


def codec(*sysids: int, vehicle: VehicleKey | None = None) -> Codec:
    vehicles = {sysid: vehicle or VehicleKey(KEY) for sysid in sysids or (1,)}
    KEPT.clear()
    return Codec(signing=Signing(vehicles, lambda: NOW_UNIX_US, KEPT.append))


def believed(receiver: Codec, *frames: bytes) -> int:
    return sum(len(receiver.parse(datagram)) for datagram in frames)


def stamp(signed: bytes) -> int:
    return int.from_bytes(signed[-12:-6], "little")


def test_a_well_signed_frame_is_believed():
    assert believed(codec(), frame()) == 1


@pytest.mark.parametrize(
    ("sent", "why"),
    [
        (frame(None), Refusal.NOT_SIGNED),
        (frame(OTHER_KEY), Refusal.FORGED),
        (damaged(frame()), Refusal.FORGED),
        (frame(KEY, NOW - OLDEST_NEW_STREAM - 1), Refusal.TOO_OLD),
    ],
)
def test_what_is_not_well_signed_is_dropped_and_counted(sent: bytes, why: Refusal):
    receiver = codec()
    assert believed(receiver, sent) == 0
    assert receiver.signing.refused == {(1, why): 1}


def test_mavlink_1_is_refused_with_and_without_a_key():
    assert believed(codec(1), frame(None, v1=True)) == 0
    assert believed(codec(2), frame(None, v1=True)) == 0


def test_a_replayed_frame_counts_once():
    receiver, sent = codec(), frame()
    assert believed(receiver, sent, sent, frame(KEY, NOW - 1)) == 1
    assert receiver.signing.refused == {(1, Refusal.REPLAYED): 2}


def test_a_forged_future_timestamp_does_not_silence_the_vehicle():
    receiver = codec()
    far = NOW + 10**12
    assert believed(receiver, frame(OTHER_KEY, far), damaged(frame(KEY, far)), frame(None, far)) == 0
    assert receiver.signing.vehicles[1] == VehicleKey(KEY)
    assert believed(receiver, frame()) == 1


def test_forged_streams_do_not_fill_the_table():
    receiver = codec()
    forged = [frame(OTHER_KEY, component=c, link=link) for c in range(1, 100) for link in range(20)]
    assert believed(receiver, *forged) == 0
    assert receiver.signing.vehicles[1].streams == {}
    assert believed(receiver, frame()) == 1


def test_the_table_of_streams_is_bounded_even_for_a_holder_of_the_key():
    receiver = codec()
    assert believed(receiver, *(frame(KEY, NOW + link, link=link) for link in range(40))) == MOST_STREAMS
    assert len(receiver.signing.vehicles[1].streams) == MOST_STREAMS


def test_a_vehicle_cannot_speak_for_another():
    receiver = Codec(signing=Signing({1: VehicleKey(KEY), 2: VehicleKey(OTHER_KEY)}, lambda: NOW_UNIX_US))
    assert believed(receiver, frame(OTHER_KEY, system=1), frame(KEY, system=2)) == 0
    assert believed(receiver, frame(OTHER_KEY, system=2), frame(KEY, system=1)) == 2


def test_a_vehicle_without_key_is_unsigned_and_taken_as_it_is():
    receiver = codec(1)
    assert believed(receiver, frame(None, system=7), frame(OTHER_KEY, system=8)) == 2
    assert (receiver.signing.trust(7), receiver.signing.trust(1)) == (Trust.UNSIGNED, Trust.SIGNED)


def test_once_signed_never_unsigned_again():
    receiver = codec()
    assert believed(receiver, frame(), frame(None), frame(KEY, NOW + 1), frame(None)) == 2


def test_what_is_sent_is_signed_anew_every_time():
    sender, message = codec(), heartbeat()
    frames = [sender.pack(message, 1) for _ in range(3)]
    assert [stamp(sent) for sent in frames] == [NOW, NOW + 1, NOW + 2]
    for sent in frames:
        assert sent[2] & 1
        assert sent[-6:] == hashlib.sha256(KEY + sent[:-6]).digest()[:6]


def test_a_vehicle_without_key_is_sent_unsigned_frames():
    sender = codec(1)
    signed, unsigned = sender.pack(heartbeat(), 1), sender.pack(heartbeat(), 2)
    assert (signed[2], unsigned[2]) == (1, 0)
    assert len(signed) == len(unsigned) + 13


def test_a_clock_that_goes_back_does_not_repeat_timestamps():
    now_us = [NOW_UNIX_US]
    signing = Signing({1: VehicleKey(KEY)}, lambda: now_us[0])
    first = signing.next_timestamp(1)
    now_us[0] -= 10**9
    assert signing.next_timestamp(1) == first + 1


def test_a_restarted_receiver_refuses_what_it_has_heard_before():
    receiver, sent = codec(), [frame(KEY, NOW + i * 1000) for i in range(500)]
    assert believed(receiver, *sent) == 500
    restarted = Codec(signing=Signing(KEPT[-1], lambda: NOW_UNIX_US))
    assert believed(restarted, *sent) == 0
    assert believed(restarted, frame(KEY, NOW + 500_000 + RESERVE)) == 1
    assert stamp(restarted.pack(heartbeat(), 1)) > stamp(receiver.pack(heartbeat(), 1))


def test_what_is_kept_is_written_before_it_counts_and_seldom():
    receiver = codec()
    for i in range(10_000):
        assert believed(receiver, frame(KEY, NOW + i * 100)) == 1
        assert KEPT[-1][1].streams[1, 0] >= NOW + i * 100
    assert len(KEPT) == 4  # of 10 s of traffic


def test_a_new_key_takes_over_with_the_first_frame_that_bears_it():
    receiver = codec(vehicle=VehicleKey(KEY, next_key=OTHER_KEY))
    assert believed(receiver, frame(KEY)) == 1
    assert believed(receiver, damaged(frame(OTHER_KEY, NOW + 5))) == 0
    assert believed(receiver, frame(OTHER_KEY, NOW + 5)) == 1
    assert believed(receiver, frame(KEY, NOW + 9)) == 0
    assert (KEPT[-1][1].key, KEPT[-1][1].next_key) == (OTHER_KEY, None)


def test_a_first_key_is_pending_until_the_vehicle_signs_and_in_force_from_then_on():
    receiver = codec(vehicle=VehicleKey(None, next_key=KEY))
    assert receiver.signing.trust(1) is Trust.PENDING
    assert believed(receiver, frame(None)) == 1
    assert receiver.pack(heartbeat(), 1)[2] == 0
    assert believed(receiver, frame(KEY)) == 1
    assert receiver.signing.trust(1) is Trust.SIGNED
    assert believed(receiver, frame(None)) == 0


def test_what_may_overtake_is_a_stream_of_its_own():
    sender = codec()
    bulk, control = sender.pack(heartbeat(), 1, link_id=1), sender.pack(heartbeat(), 1, link_id=0)
    assert (bulk[-13], control[-13]) == (1, 0)
