"""Who is in command: one of those at the page at a time; the others look on. Pure."""

from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass
class CommandSeat:
    """The seat of the operator.

    The first one to come sits down; whoever comes while the seat is empty, too, so that a reload keeps it. Everybody
    may take it over, which all others see.

    Args:
        on_change: called with a sentence when the seat changes hands.
    """

    on_change: Callable[[str], None]
    present: dict[str, str] = field(default_factory=dict[str, str])
    """Key -> name of everybody at the page."""
    holder: str | None = None
    """Key of who is in command."""

    @property
    def holder_name(self) -> str | None:
        return self.present.get(self.holder) if self.holder is not None else None

    def arrive(self, key: str, name: str) -> None:
        """Somebody opens the page."""
        self.present[key] = name
        if self.holder is None:
            self.holder = key
            if len(self.present) > 1:
                self.on_change(f"{name} is in command")

    def leave(self, key: str) -> None:
        """Somebody closes it, or is no longer heard."""
        name = self.present.pop(key, None)
        if key == self.holder:
            self.holder = None
            if self.present:
                self.on_change(f"{name} has left: nobody is in command")

    def take(self, key: str) -> None:
        """Take over the command."""
        if key in self.present and key != self.holder:
            before = self.holder_name
            self.holder = key
            self.on_change(f"{self.present[key]} has taken command" + (f" from {before}" if before else ""))

    def why_not(self, key: str | None) -> str | None:
        """Why somebody may not command, as a phrase; None if they may. The program itself (None) always may."""
        if key is None or key == self.holder:
            return None
        return f"{self.holder_name} is in command" if self.holder is not None else "nobody is in command: take it first"
