"""What the vehicle has seen and its mission does not explain, on its way to the ground within a budget. Sans-IO.

Blocks of voxels that have changed go first, those nearest to the vehicle before the others; what budget is left
repeats the others in turn, so that whatever was lost on the link arrives in the end.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from companion.report_budget import ReportBudget
from missions.occupancy import (
    BLOCK_VOXELS,
    BlockIndex,
    OccupancyBlock,
    blocks_of,
    centres_of,
    encode_block,
    voxels_of,
)

Array = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.int64]

COARSENING = 2
"""A reported voxel is so many times as large as one of the map: the cloud plans with metres, the link has few bytes."""
FRAME_BYTES = 110
"""One block on the wire, with TUNNEL's and MAVLink's headers."""
REPEAT_S = 2.0
"""A block that has not changed is repeated no sooner than so long after it was sent [s]."""
MOST_BLOCKS = 2048
"""Kept; beyond these the farthest are forgotten."""
BURST_S = 0.5
"""So much of the budget may be saved up [s]."""


@dataclass
class _Block:
    occupied: BoolArray
    revision: int
    sent_s: float = -np.inf
    changed: bool = True


class Observations:
    """One vehicle's report of what it has seen.

    Args:
        map_voxel_m: edge of a voxel of the map, which holds what the mission does not explain [m].
        budget: what of the link is for these reports.
    """

    def __init__(self, map_voxel_m: float, budget: ReportBudget) -> None:
        self.voxel_m = COARSENING * map_voxel_m
        self._budget = budget
        self._blocks: dict[BlockIndex, _Block] = {}
        self._saved_bytes, self._saved_at_s = 0.0, -np.inf

    @property
    def voxels(self) -> IntArray:
        """(n, 3) indices of the voxels that are reported as occupied."""
        blocks = [np.argwhere(b.occupied) + BLOCK_VOXELS * np.array(index) for index, b in self._blocks.items()]
        return np.concatenate(blocks) if blocks else np.empty((0, 3), np.int64)

    def update(self, occupied_enu_m: Array, low_m: Array, high_m: Array, now_s: float) -> None:
        """Take in a window of the map; what lies outside of it stays as it was.

        Args:
            occupied_enu_m: (n, 3) centres of the occupied voxels in the window, ENU [m].
            low_m: (3,) its lowest corner, ENU [m].
            high_m: (3,) its highest corner.
            now_s: vehicle time.
        """
        edge_m = BLOCK_VOXELS * self.voxel_m
        found = blocks_of(voxels_of(occupied_enu_m, self.voxel_m))
        for index in found.keys() | self._blocks.keys():
            corner_m = np.array(index) * edge_m
            if np.all(corner_m < high_m) and np.all(corner_m + edge_m > low_m):
                self._change(index, found.get(index), low_m, high_m, now_s)
        self._forget_farthest(0.5 * (low_m + high_m))

    def due(self, position_m: Array, now_s: float) -> list[bytes]:
        """The payloads that may be sent now: changes first, nearest first, then repetitions.

        Args:
            position_m: (3,) of the vehicle, ENU [m].
            now_s: vehicle time.
        """
        affordable = int(self._save_up(now_s) // FRAME_BYTES)
        changed = [index for index, block in self._blocks.items() if block.changed]
        changed.sort(key=lambda index: self._distance_m(index, position_m))
        repeated = [i for i, block in self._blocks.items() if not block.changed and now_s - block.sent_s >= REPEAT_S]
        repeated.sort(key=lambda index: self._blocks[index].sent_s)
        for_repeats = max(affordable - len(changed), 0)
        chosen = changed[:affordable] + repeated[:for_repeats]
        self._saved_bytes -= FRAME_BYTES * len(chosen)
        self._budget.spent(len(chosen), now_s)
        return [self._sent(index, now_s) for index in chosen]

    def _sent(self, index: BlockIndex, now_s: float) -> bytes:
        block = self._blocks[index]
        block.sent_s, block.changed = now_s, False
        return encode_block(OccupancyBlock(index, self.voxel_m, block.revision, block.occupied))

    def _save_up(self, now_s: float) -> float:
        passed_s = min(max(now_s - self._saved_at_s, 0.0), BURST_S)
        self._saved_at_s = now_s
        bytes_s = self._budget.bytes_s(now_s)
        self._saved_bytes = min(self._saved_bytes + passed_s * bytes_s, max(BURST_S * bytes_s, FRAME_BYTES))
        return self._saved_bytes

    def _change(self, index: BlockIndex, seen: BoolArray | None, low_m: Array, high_m: Array, now_s: float) -> None:
        """A block as the window shows it now: voxels with their middle outside of the window stay as they were."""
        known = self._blocks.get(index)
        before = known.occupied if known is not None else np.zeros((BLOCK_VOXELS,) * 3, np.bool_)
        after = np.zeros_like(before) if seen is None else seen
        if np.array_equal(before, after):
            return
        grid = np.indices(before.shape).reshape(3, -1).T + BLOCK_VOXELS * np.array(index)
        middles_m = centres_of(grid, self.voxel_m)
        in_window = np.all((middles_m >= low_m) & (middles_m <= high_m), axis=1).reshape(before.shape)
        after = np.where(in_window, after, before)
        if not np.array_equal(before, after):
            self._blocks[index] = _Block(after, round(now_s * 1e3) % 2**32)

    def _distance_m(self, index: BlockIndex, position_m: Array) -> float:
        edge_m = BLOCK_VOXELS * self.voxel_m
        return float(np.linalg.norm((np.array(index) + 0.5) * edge_m - position_m))

    def _forget_farthest(self, position_m: Array) -> None:
        if len(self._blocks) > MOST_BLOCKS:
            farthest = sorted(self._blocks, key=lambda index: self._distance_m(index, position_m))[MOST_BLOCKS:]
            for index in farthest:
                del self._blocks[index]
