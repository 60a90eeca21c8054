"""What can go wrong in the ground station; each error carries a sentence for the operator."""


class GcsError(Exception):
    """Base of the ground station's errors."""


class UsageError(GcsError):
    """The operator asked for something that cannot be: exit code 2, nothing was sent."""


class KeyRingError(UsageError):
    """Signing keys that cannot be read, or be kept."""


class BadFile(UsageError):
    """A file that cannot be used.

    Args:
        name: of the file.
        where: line, key or item; empty for the file as a whole.
        problem: what was expected and what was found.
    """

    def __init__(self, name: str, where: str, problem: str) -> None:
        super().__init__(": ".join(part for part in (name, where, problem) if part))


class RecordingError(UsageError):
    """A recording that cannot be read, or has nothing whole in it."""


class LinkLost(GcsError):
    """No answer, in spite of repeated requests."""


class CommandRefused(GcsError):
    """An autopilot or companion refused a command."""


class AmbiguousVehicle(GcsError):
    """More than one vehicle answers to a system id; nothing was sent."""


class MissionTransferError(GcsError):
    """A mission or fence could not be stored, or what is stored is not what was sent."""


class ParameterError(GcsError):
    """A parameter could not be read or set."""


class PreflightError(GcsError):
    """A vehicle is not fit for the flight; nothing was armed."""


class FlightAborted(GcsError):
    """The flight ended before every vehicle was at its target."""


class ProcessFailed(GcsError):
    """A program that this one started has ended by itself."""
