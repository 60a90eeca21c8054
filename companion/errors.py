"""What can go wrong in a companion; every message says what, where, what was expected and what was found."""


class CompanionError(Exception):
    """Base of all errors of this program."""


class UsageError(CompanionError):
    """Input that cannot be used: an option, a port in use; the program ends with code 2."""


class CommandRefused(CompanionError):
    """The autopilot refused what it was asked for, or did not answer."""
