"""Reports take of the link what it carries: less when it loses, queues up or falls silent, and more again after."""

import numpy as np
import pytest

from companion.events import Sender
from companion.report_budget import LEAST_SHARE, SILENCE_S, ReportBudget
from missions.tunnel import RECEIPT_COUNTS, Receipt

FULL = 3300.0
GROUND, OTHER = Sender(255, 190), Sender(254, 190)
PER_SECOND = 30


class Link:
    """Seconds of reports over a link, and a ground station's receipts for them."""

    def __init__(self, heard: int = 0, speed: float = 1.0) -> None:
        self.budget = ReportBudget(FULL, speed)
        self.now_s, self.heard, self.speed = 100.0, heard, speed
        self.rng = np.random.default_rng(0)

    def go_on(self, seconds: int, loss: float = 0.0, delay_s: float = 0.1, sender: Sender = GROUND) -> float:
        """The budget after so many seconds of the ground station's clock."""
        for _ in range(seconds):
            for _ in range(PER_SECOND):
                self.now_s += self.speed / PER_SECOND
                self.budget.spent(1, self.now_s)
                self.heard += self.rng.random() >= loss
            boot_ms = round(self.now_s * 1e3)
            receipt = Receipt(heard=self.heard % RECEIPT_COUNTS, time_boot_ms=boot_ms, age_s=0.0)
            self.budget.take(sender, receipt, self.now_s + delay_s * self.speed)
        return self.budget.bytes_s(self.now_s)

    def fall_silent(self, seconds: int) -> float:
        """Likewise, the budget asked for ten times a second, and no receipt coming."""
        for _ in range(10 * seconds):
            self.now_s += 0.1 * self.speed
            self.budget.bytes_s(self.now_s)
        return self.budget.bytes_s(self.now_s)


@pytest.mark.parametrize("loss", [0.0, 0.05])
def test_a_good_link_is_given_all_of_the_budget(loss: float):
    assert Link().go_on(60, loss) == FULL


def test_a_tenth_lost_leaves_most_of_it():
    link = Link()
    assert np.mean([link.go_on(1, 0.1) for _ in range(60)]) > 0.9 * FULL


def test_heavy_losses_shrink_it_and_it_grows_back():
    link = Link()
    assert link.go_on(10, loss=0.5) == pytest.approx(LEAST_SHARE * FULL)
    assert link.go_on(2) < FULL
    assert link.go_on(10) == FULL


def test_frames_that_queue_up_shrink_it_and_it_grows_back():
    link = Link()
    link.go_on(5)
    assert link.go_on(3, delay_s=1.5) < 0.5 * FULL
    assert link.go_on(12) == FULL


def test_a_link_that_was_always_slow_is_not_taken_for_a_backlog():
    assert Link().go_on(20, delay_s=2.0) == FULL


@pytest.mark.parametrize("speed", [1.0, 5.0])
def test_silence_shrinks_it_to_the_least(speed: float):
    link = Link(speed=speed)
    link.go_on(5)
    assert link.fall_silent(int(SILENCE_S) - 1) == FULL
    assert link.fall_silent(10) == pytest.approx(LEAST_SHARE * FULL)
    assert link.go_on(12) == FULL


def test_where_no_ground_station_says_what_it_hears_the_budget_stays():
    assert Link().fall_silent(60) == FULL


def test_what_was_heard_before_the_first_receipt_is_nobodys_loss():
    assert Link(heard=RECEIPT_COUNTS - 40).go_on(5) == FULL


def test_a_second_ground_station_has_no_say_while_the_first_is_heard():
    link = Link()
    link.go_on(5)
    link.budget.take(OTHER, Receipt(heard=0, time_boot_ms=0, age_s=60.0), link.now_s)
    assert link.go_on(1) == FULL
    link.fall_silent(5)
    assert link.go_on(12, sender=OTHER) == FULL
