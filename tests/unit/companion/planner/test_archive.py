"""The external archive and the leader rule."""

import numpy as np

from companion.planner.archive import MARK, Offer, best_ranked, leader, new_archive, offer
from companion.planner.dominance import pareto_dominates, weighted_dominates, weighted_sum

PHI = np.array([0.3, 0.4, 0.3])


def value(*objectives: float) -> np.ndarray:
    return np.array([*objectives, 0.0, 0.0])


def filled(values: list[np.ndarray], capacity: int = 50, *, weighted: bool = True):
    """An archive to which all has been offered, and what became of each."""
    archive = new_archive(capacity, 2)
    outcomes = [offer(archive, np.full(2, float(i)), v, PHI, weighted) for i, v in enumerate(values)]
    return archive, [Offer(outcome) for outcome in outcomes]


def entries(archive) -> np.ndarray:
    return archive.values[: archive.n[0], :3]


def cloud(n: int, seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [value(*point) for point in rng.uniform(0.0, 1.0, (n, 3))]


def test_without_weighted_dominance_it_holds_the_pareto_front_of_what_it_was_offered():
    offered = cloud(200, 1)
    archive, _ = filled(offered, capacity=200, weighted=False)
    front = {tuple(v[:3]) for v in offered if not any(pareto_dominates(other, v) for other in offered)}
    assert {tuple(entry) for entry in entries(archive)} == front
    assert not archive.values[: archive.n[0], MARK].any()


def test_no_entry_pareto_dominates_another_and_marks_are_right():
    archive, _ = filled(cloud(300, 2), capacity=24)
    held = archive.values[: archive.n[0]]
    for entry in held:
        others = [other for other in held if other is not entry]
        assert not any(pareto_dominates(other, entry) for other in others)
        if entry[MARK] == 0.0:
            assert not any(weighted_dominates(other, entry, PHI) for other in others)


def test_marked_entries_fill_at_most_half_of_it():
    archive, _ = filled(cloud(400, 3), capacity=20)
    assert archive.values[: archive.n[0], MARK].sum() <= 10 + 1  # one more may be marked by a later entry
    assert archive.n[0] <= 20


def test_a_dominated_candidate_is_rejected_and_a_dominating_one_replaces():
    archive, outcomes = filled([value(1, 1, 1), value(2, 2, 2), value(0, 1, 1), value(0, 1, 1)])
    assert outcomes == [Offer.ADDED, Offer.REJECTED, Offer.ADDED_DOMINANT, Offer.REJECTED]
    assert entries(archive).tolist() == [[0, 1, 1]]
    assert archive.x[0].tolist() == [2, 2]


def test_when_it_is_full_the_worst_ranked_goes_marked_ones_first():
    marked, best, middle = value(0.0, 3.0, 3.0), value(0.5, 0.6, 0.6), value(0.9, 0.5, 0.25)
    archive, _ = filled([best, marked, middle], capacity=3)
    assert archive.values[:3, MARK].tolist() == [0.0, 1.0, 0.0]
    newcomer = value(0.4, 0.4, 1.2)
    assert offer(archive, np.zeros(2), newcomer, PHI, True) != Offer.REJECTED
    assert [0.0, 3.0, 3.0] not in entries(archive).tolist()


def test_a_newcomer_that_is_the_worst_itself_stays_out_of_a_full_archive():
    archive, _ = filled([value(0, 1, 1), value(1, 0, 1)], capacity=2)
    assert offer(archive, np.zeros(2), value(9.0, 9.0, 0.0), PHI, True) == Offer.REJECTED


def test_the_best_ranked_has_the_least_weighted_sum():
    archive, _ = filled(cloud(100, 4))
    ranks = [weighted_sum(entry, PHI) for entry in entries(archive)]
    assert best_ranked(archive, PHI) == int(np.argmin(ranks))


def test_the_leader_rule():
    """k dominant generations: the best-ranked; k barren ones: a random marked entry; else a random unmarked one."""
    archive, _ = filled(cloud(100, 5))
    marks = archive.values[: archive.n[0], MARK]
    assert 0 < marks.sum() < archive.n[0]
    rng = np.random.default_rng(6)
    converging = {leader(archive, 3, 0, 3, PHI, rng) for _ in range(50)}
    stuck = {leader(archive, 0, 3, 3, PHI, rng) for _ in range(200)}
    between = {leader(archive, 2, 0, 3, PHI, rng) for _ in range(200)}
    assert converging == {best_ranked(archive, PHI)}
    assert stuck == set(np.flatnonzero(marks == 1.0).tolist())
    assert between == set(np.flatnonzero(marks == 0.0).tolist())


def test_without_marked_entries_the_best_ranked_leads_out_of_a_local_optimum():
    archive, _ = filled([value(1, 1, 1)])
    assert leader(archive, 0, 9, 3, PHI, np.random.default_rng(0)) == 0
