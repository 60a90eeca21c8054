"""What a receive path has to offer to be fuzzed."""

from abc import ABC, abstractmethod


class Target(ABC):
    """One receive path; add a new one to `TARGETS`."""

    @abstractmethod
    def feed(self) -> None:
        """Take in some hostile traffic; raises if anything gets out of the receive path."""

    @abstractmethod
    def check(self) -> None:
        """Raise AssertionError if something is no longer sound."""

    def close(self) -> None:
        """Leave nothing running."""
        return
