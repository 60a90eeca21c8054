"""The companion's status: what is in it, and when it is due."""

from companion.crew import Figures
from missions.tunnel import CompanionState, CompanionStatus, Reason

ROUNDING_S = 1e-3


class StatusDesk:
    """Writes the status, at fixed intervals and whenever something in it changes that others act on.

    Args:
        mission_digest: of the mission file.
        interval_s: vehicle time between two.
    """

    def __init__(self, mission_digest: int, interval_s: float) -> None:
        self._mission_digest = mission_digest
        self._interval_s = interval_s
        self._last_s = float("-inf")
        self._last: tuple[CompanionState, Reason, int] | None = None

    def write(
        self, state: CompanionState, reason: Reason, plan_id: int, track_index: int, figures: Figures, now_s: float
    ) -> CompanionStatus | None:
        """The status, if it is due."""
        if abs(now_s - self._last_s) < self._interval_s - ROUNDING_S and (state, reason, plan_id) == self._last:
            return None
        self._last_s, self._last = now_s, (state, reason, plan_id)
        return CompanionStatus(
            state=state,
            reason=reason,
            mission_digest=self._mission_digest,
            plan_id=plan_id,
            track_index=track_index,
            replans=figures.replans,
            replan_p50_ms=figures.replan_ms.at(0.5),
            replan_p99_ms=figures.replan_ms.at(0.99),
            tracking_error_p99_m=figures.tracking_error_m.at(0.99),
            tick_lateness_max_ms=figures.lateness_max_ms,
            time_boot_ms=int(now_s * 1e3),
        )
