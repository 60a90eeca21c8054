"""The upload matrix in virtual time: items x loss, trial by trial."""

import statistics
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from gcs.microservices.verified_upload import VerifiedUpload
from sitl.microservices.mission_transfer_server import MissionType
from tests.benchmarks.link.conditions import ITEMS, LOSSES, MANY_ITEMS, USUAL_ITEMS, waypoints
from tests.benchmarks.link.conversation import UP, Conversation, LinkModel

TOLERANCE = 1.3
LONGEST_ACCEPTED_S = {
    (USUAL_ITEMS, 0.0): 0.84,
    (USUAL_ITEMS, 0.1): 3.0,
    (USUAL_ITEMS, 0.3): 8.5,
    (MANY_ITEMS, 0.0): 6.6,
    (MANY_ITEMS, 0.1): 30.0,
    (MANY_ITEMS, 0.3): 92.0,
}
"""(items, loss) -> what a window of 16 takes to the acknowledgement; `TOLERANCE` times it is allowed."""
MOST_ITEM_MESSAGES = 3.0
"""Per item, up to 10 % loss."""


@dataclass(frozen=True)
class Trial:
    """One upload."""

    right: bool
    """The client says stored, and exactly that is stored; and nothing but the old or the whole new plan ever was."""
    accepted_s: float
    verified_s: float
    messages_per_item: float
    frames_up_per_item: float


@dataclass(frozen=True)
class Cell:
    """All trials of one number of items at one loss."""

    n_items: int
    loss: float
    trials: tuple[Trial, ...]

    @property
    def right(self) -> int:
        return sum(trial.right for trial in self.trials)

    @property
    def accepted_s(self) -> float:
        return statistics.median(trial.accepted_s for trial in self.trials)

    @property
    def verified_s(self) -> float:
        return statistics.median(trial.verified_s for trial in self.trials)

    @property
    def messages_per_item(self) -> float:
        return statistics.mean(trial.messages_per_item for trial in self.trials)

    @property
    def frames_up_per_item(self) -> float:
        return statistics.mean(trial.frames_up_per_item for trial in self.trials)

    def missed(self) -> Iterator[str]:
        """Yield a sentence for every required figure that is not met."""
        name = f"{self.n_items} items at {self.loss:.0%} loss"
        if self.right < len(self.trials):
            yield f"{name}: right in {self.right} of {len(self.trials)} trials"
        limit_s = LONGEST_ACCEPTED_S.get((self.n_items, self.loss))
        if limit_s is not None and self.accepted_s > TOLERANCE * limit_s:
            yield f"{name}: {self.accepted_s:.2f} s, at most {TOLERANCE * limit_s:.2f} s are allowed"
        if self.loss <= 0.1 and self.messages_per_item > MOST_ITEM_MESSAGES:
            yield f"{name}: {self.messages_per_item:.2f} item messages per item, at most {MOST_ITEM_MESSAGES:g}"


def trial(n_items: int, loss: float, seed: int) -> Trial:
    """One upload in virtual time over a link with 50 ms each way."""
    rng = np.random.default_rng((seed, n_items, round(100 * loss)))
    old, new = tuple(waypoints(7, rng)), tuple(waypoints(n_items, rng))
    talk = Conversation(LinkModel(loss), rng)
    talk.shelf.store(MissionType.MISSION, old)
    upload = VerifiedUpload(new, (1, 1))
    talk.run(upload)
    whole = all(stored in (old, new) for stored in talk.shelf.history)
    right = upload.done and whole and talk.shelf.plan(MissionType.MISSION).items == new
    return Trial(right, upload.accepted_s, talk.now_s, upload.items_sent / n_items, talk.frames[UP] / n_items)


def matrix(seeds: range, *, quick: bool) -> Iterable[Cell]:
    """Cell after cell; with many items a sixth of the trials, and quickly none."""
    for n_items in [n for n in ITEMS if n < MANY_ITEMS or not quick]:
        chosen = seeds if n_items < MANY_ITEMS else seeds[: max(1, len(seeds) // 6)]
        for loss in LOSSES:
            yield Cell(n_items, loss, tuple(trial(n_items, loss, seed) for seed in chosen))
