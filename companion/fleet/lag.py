"""How long a vehicle's word takes to arrive, measured by its own time stamps."""


class Lag:
    """The shortest and the longest way of a vehicle's messages lately.

    Two windows follow one another: a figure is forgotten after one to two of them.

    Args:
        window_s: this vehicle's time.
    """

    def __init__(self, window_s: float = 5.0) -> None:
        self._window_s = window_s
        self._since_s = float("-inf")
        self._before = self._present = (float("inf"), float("-inf"))

    def add(self, lag_s: float, now_s: float) -> None:
        """A message has taken so long."""
        self._turn(now_s)
        shortest_s, longest_s = self._present
        self._present = min(shortest_s, lag_s), max(longest_s, lag_s)

    def longest_s(self, now_s: float) -> float:
        """The longest way [s]; minus infinity when nothing was heard lately."""
        self._turn(now_s)
        return max(self._before[1], self._present[1])

    def _turn(self, now_s: float) -> None:
        passed_s = now_s - self._since_s
        if passed_s >= self._window_s:
            nothing = (float("inf"), float("-inf"))
            self._before = self._present if passed_s < 2.0 * self._window_s else nothing
            self._present, self._since_s = nothing, now_s
