"""What several vehicles have seen becomes one map."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from gcs.mapping.observed_map import MOST_BLOCKS, ObservedMap, merged
from missions import obstacles
from missions.mission import load_mission
from missions.occupancy import BLOCK_VOXELS, BlockIndex, OccupancyBlock, blocks_of, voxels_of
from missions.world import Bounds, World

BOUNDS = load_mission("indoor").world.bounds


def block(index: BlockIndex = (0, 0, 0), revision: int = 1, *voxels: tuple[int, int, int]) -> OccupancyBlock:
    occupied = np.zeros((BLOCK_VOXELS,) * 3, np.bool_)
    for voxel in voxels:
        occupied[voxel] = True
    return OccupancyBlock(index, 0.2, revision, occupied)


def report(observed: ObservedMap, sysid: int, points_m: np.ndarray, revision: int = 1) -> None:
    for index, occupied in blocks_of(voxels_of(points_m, 0.2)).items():
        observed.fold(sysid, OccupancyBlock(index, 0.2, revision, occupied))


def test_one_vehicle_benefits_from_what_another_saw():
    observed = ObservedMap(BOUNDS)
    observed.fold(1, block((0, 0, 0), 1, (1, 2, 3)))
    observed.fold(2, block((0, 0, 0), 9, (1, 2, 3), (4, 4, 4)))
    assert observed.voxels.tolist() == [[1, 2, 3], [4, 4, 4]]
    assert observed.points_of(1).tolist() == [pytest.approx([0.3, 0.5, 0.7])]


def test_a_vehicle_takes_back_what_it_saw_but_not_what_another_saw():
    observed = ObservedMap(BOUNDS)
    observed.fold(1, block((0, 0, 0), 1, (1, 1, 1)))
    observed.fold(2, block((0, 0, 0), 1, (1, 1, 1)))
    assert observed.fold(1, block((0, 0, 0), 2))
    assert observed.voxels.tolist() == [[1, 1, 1]]
    observed.fold(2, block((0, 0, 0), 2))
    assert len(observed.voxels) == 0


def test_an_old_report_that_arrives_late_changes_nothing():
    observed = ObservedMap(BOUNDS)
    observed.fold(1, block((0, 0, 0), 5, (1, 1, 1)))
    assert not observed.fold(1, block((0, 0, 0), 4))
    assert not observed.fold(1, block((0, 0, 0), 5))
    assert len(observed.voxels) == 1


def test_revisions_wrap():
    observed = ObservedMap(BOUNDS)
    observed.fold(1, block((0, 0, 0), 2**32 - 1, (1, 1, 1)))
    assert observed.fold(1, block((0, 0, 0), 0))


def test_a_repetition_does_not_count_as_a_change():
    observed = ObservedMap(BOUNDS)
    observed.fold(1, block((0, 0, 0), 1, (1, 1, 1)))
    before = observed.changes
    assert not observed.fold(1, block((0, 0, 0), 2, (1, 1, 1)))
    assert observed.changes == before


def test_blocks_from_nowhere_and_floods_are_refused():
    observed = ObservedMap(BOUNDS)
    assert not observed.fold(1, block((500, 0, 0), 1, (0, 0, 0)))
    observed.fold(1, block((0, 0, 0), 1, (0, 0, 0)))
    other_size = OccupancyBlock((1, 0, 0), 0.3, 1, block().occupied)
    assert not observed.fold(2, other_size)
    assert observed.refused == 2
    wide = ObservedMap(Bounds(east_m=(0, 1e5), north_m=(0, 1e5), up_m=(0, 1e3)))
    for number in range(MOST_BLOCKS + 10):
        wide.fold(1, block((number, 0, 0), 1, (0, 0, 0)))
    assert wide.refused == 10


def test_a_companion_that_started_anew_is_believed_anew():
    observed = ObservedMap(BOUNDS)
    observed.fold(1, block((0, 0, 0), 50, (1, 1, 1)))
    observed.forget(1)
    assert len(observed.voxels) == 0
    assert observed.fold(1, block((0, 0, 0), 1, (1, 1, 1)))


@given(hnp.arrays(np.bool_, (5, 4, 6)))
def test_merged_boxes_cover_exactly_the_voxels_and_do_not_overlap(occupied: np.ndarray):
    covered = np.zeros(occupied.shape, np.int64)
    for east, north, up, east_end, north_end, up_end in merged(np.argwhere(occupied)):
        covered[east:east_end, north:north_end, up:up_end] += 1
    np.testing.assert_array_equal(covered, occupied.astype(np.int64))


def test_a_full_block_is_one_box():
    assert merged(np.argwhere(np.ones((8, 8, 8), np.bool_))).tolist() == [[0, 0, 0, 8, 8, 8]]


@given(st.integers(0, 50))
def test_every_point_that_was_seen_is_inside_of_an_obstacle(seed: int):
    points_m = np.random.default_rng(seed).uniform((2, 2, 0.1), (6, 6, 3), (40, 3))
    observed = ObservedMap(BOUNDS)
    report(observed, 1, points_m)
    solid = obstacles.pack(World(bounds=BOUNDS, boxes=observed.boxes()))
    assert obstacles.clearance(points_m, solid).max() <= 1e-9


def test_a_wall_with_gaps_between_its_rays_becomes_few_boxes():
    east, up = np.meshgrid(np.arange(2.0, 6.0, 0.35), np.arange(0.2, 3.0, 0.35))
    observed = ObservedMap(BOUNDS)
    report(observed, 1, np.column_stack((east.ravel(), np.full(east.size, 7.05), up.ravel())))
    assert len(observed.boxes()) <= 4


def test_the_distance_to_what_was_seen_is_that_to_its_voxels():
    observed, rng = ObservedMap(BOUNDS), np.random.default_rng(3)
    points_m = rng.uniform([1.0, 1.0, 0.5], [19.0, 14.0, 3.5], (500, 3))
    assert np.all(np.isinf(observed.clearance(points_m)))
    wall_m = np.column_stack((np.full(400, 8.0), rng.uniform(4.0, 9.0, 400), rng.uniform(0.1, 3.0, 400)))
    report(observed, 1, wall_m)
    spans = merged(observed.voxels) * 0.2
    beside_m = np.maximum(np.maximum(spans[:, :3] - points_m[:, None], points_m[:, None] - spans[:, 3:]), 0.0)
    np.testing.assert_allclose(observed.clearance(points_m), np.linalg.norm(beside_m, axis=2).min(axis=1), atol=1e-9)
    np.testing.assert_allclose(observed.clearance(points_m[:1]), observed.clearance(points_m)[:1])
