"""How vehicles speak and listen on the fleet link; vehicle time."""

from dataclasses import dataclass


@dataclass(frozen=True)
class FleetSettings:
    """Times and distances of the exchange of plans."""

    repeat_s: float = 0.5
    """Every plan that is flown is told again so often ..."""
    copies_at_once: int = 3
    """What is new is told in so many ticks one after the other: one loss does not undo the wait ..."""
    urgent_repeat_s: float = 0.1
    """... and more often while it is new, and while it is not flown yet ..."""
    urgent_s: float = 0.35
    """... new is what was announced no longer ago."""
    position_interval_s: float = 0.25
    least_wait_s: float = 0.06
    """Between a plan's announcement and its commitment, when somebody listens ..."""
    longest_wait_s: float = 1.0
    """... and at most; a link that takes longer is as good as none."""
    wait_margin_s: float = 0.06
    """Longer than the longest that anybody's word took lately: for copies, ticks at both ends, clocks that differ."""
    clock_bound_s: float = 0.05
    """Clocks that are set by GNSS differ by no more. Plans from farther in the future are not believed."""
    latest_s: float = 3.0
    """A word that is on its way for so long, as its time stamp says, comes from somebody with another clock."""
    stale_s: float = 1.5
    """A plan that was not repeated for so long counts less than a fresh position; and its radius begins to grow."""
    growth_m_s: float = 0.25
    """The radius of who is silent grows so fast ..."""
    most_growth_m: float = 0.75
    """... up to this: a room must not be closed by one dead radio."""
    off_plan_m: float = 0.75
    """A vehicle farther from its plan than this, and than its position may be wrong, does not fly that plan."""
    foretold_s: float = 3.0
    """A vehicle without a plan goes on for so long as it moves, and then rests."""
    most_neighbours: int = 24
    """The planner is told of so many, the nearest."""
