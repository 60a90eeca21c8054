"""The dead-man: a companion that hangs while it flies is ended by the kernel, on time.

MAVSDK's own thread goes on streaming the last setpoint for a program that hangs, so the autopilot would never notice. A
watchdog thread in Python cannot help: it does not run while something holds the interpreter lock. An interval timer of
the kernel does, with SIGALRM left at its default action, which is to end the process.
"""

import signal
from typing import Protocol


class DeadMan(Protocol):
    """What has to be fed while the vehicle is under control."""

    def feed(self) -> None:
        """All is well; it is armed from now on."""
        ...

    def disarm(self) -> None:
        """Nothing is flown: hanging harms nobody."""
        ...


class KernelTimer:
    """Ends the process when it is not fed for `limit_s` of wall-clock time.

    To be made and used in the main thread.

    Args:
        limit_s: below the autopilot's COM_OF_LOSS_T, so that the stream ends before it would matter.
    """

    def __init__(self, limit_s: float) -> None:
        self._limit_s = limit_s
        self._armed = False
        signal.signal(signal.SIGALRM, signal.SIG_DFL)

    def feed(self) -> None:
        """All is well; costs a microsecond."""
        signal.setitimer(signal.ITIMER_REAL, self._limit_s)
        self._armed = True

    def disarm(self) -> None:
        """Stop the timer, if it runs."""
        if self._armed:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            self._armed = False
