"""How long a search may go on."""

from gcs.planner.budget import DEFAULT_EVALUATIONS, IMPROVING_EVALUATIONS, STUBBORN_EVALUATIONS, new_budget


class Clock:
    """Stands still unless told."""

    now_s = 10.0

    def __call__(self) -> float:
        return self.now_s


def test_a_number_of_evaluations_is_used_up_evenly_and_stays_what_it_is():
    budget = new_budget(400, None, Clock(), None)
    assert (budget.share_done(100), budget.share_done(500), budget.left(100)) == (0.25, 1.0, 300)
    assert budget.settled(390) == budget
    assert not budget.interrupted()


def test_a_time_is_used_up_on_the_clock():
    clock = Clock()
    budget = new_budget(None, 4.0, clock, None)
    clock.now_s = 11.0
    assert (budget.share_done(10**6), budget.interrupted()) == (0.25, False)
    assert budget.left(10**6) > 10**6
    clock.now_s = 14.0
    assert budget.interrupted()


def test_of_two_limits_the_nearer_one_counts():
    clock = Clock()
    budget = new_budget(1000, 4.0, clock, None)
    clock.now_s = 12.0
    assert (budget.share_done(100), budget.share_done(700)) == (0.5, 0.7)


def test_somebody_may_stop_it():
    assert new_budget(1000, None, Clock(), lambda: True).interrupted()


def test_without_limits_it_is_long_until_there_is_a_plan_and_then_the_default_but_with_time_to_improve():
    budget = new_budget(None, None, Clock(), None)
    assert budget.evaluations == STUBBORN_EVALUATIONS
    assert budget.settled(100).evaluations == DEFAULT_EVALUATIONS
    assert budget.settled(3000).evaluations == 3000 + IMPROVING_EVALUATIONS
    assert budget.settled(100).settled(3000).evaluations == DEFAULT_EVALUATIONS
