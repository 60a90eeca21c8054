"""What can be wrong with a mission: every message says what, where, what was expected and what was found."""

from pathlib import Path


class MissionError(Exception):
    """Base of all errors about missions."""


class ConfigError(MissionError):
    """A mission file that cannot be used.

    Args:
        path: the file.
        line: 1-based line of the offending key, or None when the file as a whole is meant.
        key: key path inside the file, such as `world.boxes[0].half_m`.
        problem: what was expected and what was found.
    """

    def __init__(self, path: Path, line: int | None, key: str, problem: str) -> None:
        where = f"{path}:{line}" if line else f"{path}"
        super().__init__(": ".join(part for part in (where, key, problem) if part))
        self.path, self.line, self.key, self.problem = path, line, key, problem


class WireFormatError(MissionError):
    """Bytes or mission items from outside that do not mean what they claim to mean."""
