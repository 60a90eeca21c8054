"""What was seen and is on no map goes to the ground, within a budget."""

import numpy as np

from companion.observations import FRAME_BYTES, MOST_BLOCKS, REPEAT_S, Observations
from companion.report_budget import ReportBudget
from missions.occupancy import decode_block

LOW_M, HIGH_M = np.array([4.0, 0.0, 0.0]), np.array([14.0, 10.0, 4.0])
HERE_M = np.array([9.0, 3.0, 1.5])
BUDGET_BYTES_S = 4000.0


def post(east_m: float = 10.0, north_m: float = 4.0) -> np.ndarray:
    """Map voxels of a post."""
    side = np.arange(-0.25, 0.26, 0.1)
    east, north, up = (grid.ravel() for grid in np.meshgrid(side, side, np.arange(0.05, 3.9, 0.1)))
    return np.column_stack((east_m + east, north_m + north, up))


def observations(budget_bytes_s: float = BUDGET_BYTES_S) -> Observations:
    return Observations(0.1, ReportBudget(budget_bytes_s))


def told(reporter: Observations, now_s: float) -> np.ndarray:
    """(n, 3) centres of voxels in what is due now."""
    blocks = [decode_block(payload) for payload in reporter.due(HERE_M, now_s)]
    seen = [(block.voxels + 0.5) * block.voxel_m for block in blocks]
    return np.concatenate(seen) if seen else np.empty((0, 3))


def test_a_post_on_no_map_is_reported_where_it_stands():
    reporter = observations()
    reporter.update(post(), LOW_M, HIGH_M, 10.0)
    points_m = told(reporter, 10.0)
    assert np.hypot(*(points_m[:, :2] - [10.0, 4.0]).T).max() <= 0.6
    assert np.ptp(points_m[:, 2]) >= 3.0


def test_what_has_not_changed_is_repeated_but_not_at_once():
    reporter = observations()
    reporter.update(post(), LOW_M, HIGH_M, 10.0)
    first = reporter.due(HERE_M, 10.0)
    reporter.update(post(), LOW_M, HIGH_M, 10.2)
    assert reporter.due(HERE_M, 10.2) == []
    assert sorted(reporter.due(HERE_M, 10.0 + REPEAT_S)) == sorted(first)


def test_what_is_gone_is_taken_back_with_a_newer_revision():
    reporter = observations()
    reporter.update(post(), LOW_M, HIGH_M, 10.0)
    before = {block.index: block for block in map(decode_block, reporter.due(HERE_M, 10.0))}
    reporter.update(np.empty((0, 3)), LOW_M, HIGH_M, 11.0)
    after = [decode_block(payload) for payload in reporter.due(HERE_M, 11.0)]
    assert {block.index for block in after} == set(before)
    assert not any(block.occupied.any() for block in after)
    assert all(block.revision > before[block.index].revision for block in after)


def test_what_lies_outside_of_the_window_stays_as_it_was():
    reporter = observations()
    reporter.update(post(), LOW_M, HIGH_M, 10.0)
    reporter.due(HERE_M, 10.0)
    reporter.update(np.empty((0, 3)), np.array([11.0, 0.0, 0.0]), np.array([19.0, 8.0, 4.0]), 11.0)
    assert len(told(reporter, 10.0 + REPEAT_S)) > 0


def test_the_budget_is_kept_and_the_nearest_go_first():
    reporter = observations(budget_bytes_s=10.0 * FRAME_BYTES)
    forest = np.concatenate([post(east, north) for east in (5.0, 8.9, 12.5) for north in (1.0, 3.0, 9.2)])
    reporter.update(forest, LOW_M, HIGH_M, 10.0)
    sent, nearest = [], None
    for tick in range(50):
        payloads = reporter.due(HERE_M, 10.0 + 0.02 * tick)
        if payloads and nearest is None:
            nearest = decode_block(payloads[0])
        sent += payloads
    assert 0 < len(sent) <= 10 + 5  # a second's budget, and what may be saved up
    assert nearest is not None
    assert np.linalg.norm((np.array(nearest.index) + 0.5) * 1.6 - HERE_M) < 1.7


def test_a_loss_is_made_good_by_repetition():
    reporter = observations()
    reporter.update(post(), LOW_M, HIGH_M, 10.0)
    rng, arrived = np.random.default_rng(0), set()
    expected = None
    for tick in range(500):
        payloads = reporter.due(HERE_M, 10.0 + 0.1 * tick)
        expected = expected or {decode_block(payload).index for payload in payloads}
        arrived |= {decode_block(payload).index for payload in payloads if rng.random() > 0.7}
    assert arrived == expected


def test_memory_is_bounded():
    reporter = Observations(1.0, ReportBudget(BUDGET_BYTES_S))
    rng = np.random.default_rng(0)
    low_m, high_m = np.zeros(3), np.array([2000.0, 2000.0, 900.0])
    reporter.update(rng.uniform((10, 10, 500), (1990, 1990, 890), (4 * MOST_BLOCKS, 3)), low_m, high_m, 1.0)
    assert len(reporter._blocks) <= MOST_BLOCKS
