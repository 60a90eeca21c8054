"""Observed obstacles as blocks of voxels, and their way over the link."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.errors import WireFormatError
from missions.occupancy import (
    BLOCK_VOXELS,
    OccupancyBlock,
    blocks_of,
    decode_block,
    encode_block,
    voxels_of,
)
from missions.tunnel import MAX_PAYLOAD_BYTES

INDICES = st.tuples(*[st.integers(-(2**15) + 1, 2**15 - 1)] * 3)


def a_block(index=(1, -2, 0), revision=7, seed=0) -> OccupancyBlock:
    occupied = np.random.default_rng(seed).random((BLOCK_VOXELS,) * 3) < 0.1
    return OccupancyBlock(index, 0.2, revision, occupied)


@given(index=INDICES, revision=st.integers(0, 2**32 - 1), seed=st.integers(0, 99))
def test_a_block_survives_the_wire(index: tuple[int, int, int], revision: int, seed: int):
    sent = a_block(index, revision, seed)
    received = decode_block(encode_block(sent))
    assert (received.index, received.revision, received.voxel_m) == (index, revision, pytest.approx(0.2))
    np.testing.assert_array_equal(received.occupied, sent.occupied)


def test_a_block_fits_one_tunnel_message():
    assert len(encode_block(a_block())) <= MAX_PAYLOAD_BYTES


def test_points_are_found_again_in_the_voxels_of_their_blocks():
    points_m = np.random.default_rng(1).uniform(-9.0, 9.0, (200, 3))
    blocks = blocks_of(voxels_of(points_m, 0.2))
    found = [OccupancyBlock(index, 0.2, 0, occupied).voxels for index, occupied in blocks.items()]
    expected = np.unique(voxels_of(points_m, 0.2), axis=0)
    np.testing.assert_array_equal(np.unique(np.concatenate(found), axis=0), expected)


@given(st.binary(max_size=120))
def test_whatever_arrives_is_a_block_or_a_wire_format_error(payload: bytes):
    try:
        block = decode_block(payload)
    except WireFormatError:
        return
    assert block.voxel_m > 0.0
    assert block.occupied.shape == (BLOCK_VOXELS,) * 3


def test_blocks_that_have_no_place_in_the_message_are_not_sent():
    with pytest.raises(ValueError, match="does not fit"):
        encode_block(a_block(index=(2**15, 0, 0)))
    with pytest.raises(ValueError, match="does not fit"):
        encode_block(OccupancyBlock((0, 0, 0), 0.0, 0, a_block().occupied))


def test_blocks_hold_each_voxel_where_it_belongs():
    voxels = np.random.default_rng(2).integers(-20, 20, (300, 3))
    blocks = blocks_of(voxels)
    assert blocks_of(voxels[:0]) == {}
    assert {tuple(v) for v in voxels.tolist()} == {
        tuple((BLOCK_VOXELS * np.array(index) + inside).tolist())
        for index, occupied in blocks.items()
        for inside in np.argwhere(occupied)
    }
