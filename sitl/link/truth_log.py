"""Where the vehicles really are, as CSV in the mission's frame, for whoever judges a flight afterwards."""

from pathlib import Path
from types import TracebackType

from sitl.simulator import Truth

HEADER = "t_s,sysid,east_m,north_m,up_m,ve_m_s,vn_m_s,vu_m_s"
FLUSH_EVERY = 5
"""Ticks; what has been flushed survives the end of the process, however it comes."""


class TruthLog:
    """A CSV file that grows by one line per vehicle and tick."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("w", encoding="ascii")
        self._file.write(HEADER + "\n")
        self._file.flush()
        self._ticks = 0

    def __enter__(self) -> "TruthLog":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def write(self, truth: Truth) -> None:
        """Append one moment."""
        rows = zip(truth.sysids, truth.position_enu_m.tolist(), truth.velocity_enu_m_s.tolist(), strict=True)
        for sysid, (east, north, up), (ve, vn, vu) in rows:
            line = f"{truth.time_s:.2f},{sysid},{east:.4f},{north:.4f},{up:.4f},{ve:.4f},{vn:.4f},{vu:.4f}\n"
            self._file.write(line)
        self._ticks += 1
        if self._ticks % FLUSH_EVERY == 0:
            self._file.flush()
