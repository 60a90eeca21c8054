"""What a vehicle has seen and no map explains, as blocks of voxels: how companions report it to the ground.

Space is divided into voxels of one size, and these into blocks of 8 x 8 x 8 that lie on a fixed grid in the mission's
ENU frame. A block travels whole, so that a lost message costs nothing but the time until its next repetition, and an
old one that arrives late is recognised by its revision. Decoders take bytes from outside: whatever is wrong with them
raises `WireFormatError`, nothing else.
"""

import struct
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from missions.errors import WireFormatError

Array = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.int64]
BlockIndex = tuple[int, int, int]

BLOCK_VOXELS = 8
"""Voxels along an edge of a block."""
VERSION = 1
_LAYOUT = struct.Struct("<BxHIhhh64s")
_INDEX_LIMIT = 2**15
_MM = 1e-3


@dataclass(frozen=True)
class OccupancyBlock:
    """One block as its sender knew it last.

    Args:
        index: of the block; its lowest corner is at `index * BLOCK_VOXELS * voxel_m`, mission ENU.
        voxel_m: edge of a voxel [m].
        revision: vehicle time at which the block was made [ms], modulo 2^32: it goes on when a companion starts anew.
        occupied: (8, 8, 8) voxels that are known to be occupied; all others are free or unknown.
    """

    index: BlockIndex
    voxel_m: float
    revision: int
    occupied: BoolArray

    @property
    def voxels(self) -> IntArray:
        """(n, 3) indices of the occupied voxels, counted from the frame's origin."""
        return np.argwhere(self.occupied) + BLOCK_VOXELS * np.array(self.index)


def voxels_of(points_enu_m: Array, voxel_m: float) -> IntArray:
    """(n, 3) indices of the voxels in which (n, 3) ENU points [m] lie."""
    return np.floor(np.asarray(points_enu_m, dtype=float) / voxel_m).astype(np.int64)


def centres_of(voxels: IntArray, voxel_m: float) -> Array:
    """(n, 3) centres [m], ENU, of the voxels with (n, 3) indices."""
    return np.asarray((voxels + 0.5) * voxel_m, dtype=np.float64)


def blocks_of(voxels: IntArray) -> dict[BlockIndex, BoolArray]:
    """(n, 3) voxel indices sorted into blocks: index -> (8, 8, 8) occupied."""
    if len(voxels) == 0:
        return {}
    blocks, inside = np.divmod(voxels, BLOCK_VOXELS)
    low = blocks.min(axis=0)
    _, size_north, size_up = blocks.max(axis=0) - low + 1
    east, north, up = (blocks - low).T
    _, firsts, which = np.unique((east * size_north + north) * size_up + up, return_index=True, return_inverse=True)
    occupied = np.zeros((len(firsts), *(BLOCK_VOXELS,) * 3), np.bool_)
    occupied[which, inside[:, 0], inside[:, 1], inside[:, 2]] = True
    return {(e, n, u): block for (e, n, u), block in zip(blocks[firsts].tolist(), occupied, strict=True)}


def encode_block(block: OccupancyBlock) -> bytes:
    """The payload of an OCCUPANCY message.

    Raises:
        ValueError: a block too far from the frame's origin, or a voxel size that has no place in the message.
    """
    voxel_mm = round(block.voxel_m / _MM)
    if not 0 < voxel_mm < 2**16 or any(abs(part) >= _INDEX_LIMIT for part in block.index):
        raise ValueError(f"block {block.index} of voxels of {block.voxel_m:g} m does not fit")
    return _LAYOUT.pack(VERSION, voxel_mm, block.revision, *block.index, np.packbits(block.occupied).tobytes())


def decode_block(payload: bytes) -> OccupancyBlock:
    """The block in an OCCUPANCY payload.

    Raises:
        WireFormatError: wrong version, length or voxel size.
    """
    if len(payload) < _LAYOUT.size:
        raise WireFormatError(f"occupancy: expected at least {_LAYOUT.size} bytes, found {len(payload)}")
    version, voxel_mm, revision, east, north, up, bits = _LAYOUT.unpack_from(payload)
    if version != VERSION or voxel_mm == 0:
        raise WireFormatError(f"occupancy: version {version}, voxels of {voxel_mm} mm")
    occupied = np.unpackbits(np.frombuffer(bits, np.uint8)).astype(np.bool_).reshape((BLOCK_VOXELS,) * 3)
    return OccupancyBlock((east, north, up), voxel_mm * _MM, revision, occupied)
