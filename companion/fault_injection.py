"""Faults that an experimenter has ordered of this very process: to die, or to hang, in the middle of a flight."""

import ctypes
import os
import signal
from collections.abc import Sequence

from missions.faults import CompanionHang, CompanionKill, Fault

FOR_GOOD_S = 1_000_000


class FaultInjection:
    """Carries out the faults that are due.

    Args:
        faults: of all vehicles.
        sysid: of this one.
    """

    def __init__(self, faults: Sequence[Fault], sysid: int) -> None:
        self._faults = sorted((fault for fault in faults if fault.vehicle == sysid), key=lambda fault: fault.at_s)
        self._since_s: float | None = None

    def tick(self, *, in_control: bool, now_s: float) -> None:
        """Look at the time: it counts from when the companion first took control [vehicle time]."""
        if in_control and self._since_s is None:
            self._since_s = now_s
        if self._since_s is None or not self._faults or now_s - self._since_s < self._faults[0].at_s:
            return
        self.carry_out(self._faults.pop(0))

    def carry_out(self, fault: Fault) -> None:
        """Do it, to this process."""
        match fault:
            case CompanionKill():
                os.kill(os.getpid(), signal.SIGKILL)
            case CompanionHang():
                hang()


def hang() -> None:
    """Sleep for good inside a call that holds the interpreter lock."""
    ctypes.PyDLL(None).sleep(FOR_GOOD_S)
