"""The lidar's datagrams: a Livox Mid-360's layout, and what is no such datagram."""

import struct

import numpy as np
import pytest

from missions.lidar_packets import POINTS_PER_PACKET, LidarPacket, LidarPacketError, pack, unpack

POINTS = np.array([[1.0, -2.0, 0.5], [0.001, 0.0, -4.999]])
PACKET = LidarPacket(time_s=12.5, frame=300, number=70_000, points_flu_m=POINTS)


def test_points_come_back_to_the_millimetre():
    found = unpack(pack(PACKET))
    np.testing.assert_allclose(found.points_flu_m, POINTS, atol=5e-4)
    assert (found.time_s, found.frame, found.number) == (12.5, 300 % 256, 70_000 % 65536)


def test_the_layout_is_the_devices():
    datagram = pack(PACKET)
    assert len(datagram) == 36 + 2 * 14
    assert struct.unpack_from("<BHHHH", datagram) == (0, len(datagram), 0, 2, 70_000 % 65536)
    assert datagram[10] == 1, "data type: Cartesian, 32 bits"
    assert struct.unpack_from("<Q", datagram, 28) == (12_500_000_000,)
    assert struct.unpack_from("<iii", datagram, 36) == (1000, -2000, 500)


def test_a_full_packet_fits_into_an_ethernet_frame_and_no_more_is_taken():
    assert len(pack(LidarPacket(0.0, 0, 0, np.ones((POINTS_PER_PACKET, 3))))) == 1380
    with pytest.raises(LidarPacketError, match="at most 96 points, found 97"):
        pack(LidarPacket(0.0, 0, 0, np.ones((POINTS_PER_PACKET + 1, 3))))


@pytest.mark.parametrize("cut", [0, 1, 35, 36, 60])
def test_a_part_of_a_packet_is_refused(cut):
    with pytest.raises(LidarPacketError, match="bytes"):
        unpack(pack(PACKET)[:cut])


@pytest.mark.parametrize("at", range(64))
def test_no_changed_byte_goes_unnoticed_but_in_what_nobody_reads(at):
    datagram = bytearray(pack(PACKET))
    datagram[at] ^= 0x10
    unread = at in (3, 4, 7, 8, 9, 11) or 12 <= at < 24
    if unread:
        unpack(bytes(datagram))
    else:
        with pytest.raises(LidarPacketError):
            unpack(bytes(datagram))
