"""What can go wrong for whoever starts the simulator."""

from pathlib import Path


class SitlError(Exception):
    """Base of the simulator's errors."""


class PortInUse(SitlError):
    """A UDP port that a vehicle needs is taken.

    Args:
        host: the address.
        port: the port.
        purpose: which link of which vehicle wants it.
    """

    def __init__(self, host: str, port: int, purpose: str) -> None:
        super().__init__(
            f"UDP port {host}:{port} ({purpose}) is in use: another simulator or autopilot runs; "
            "stop it, or shift all ports with --instance-base"
        )
        self.port = port


class NoStandardInput(SitlError):
    """`--supervised` without anything to watch."""

    def __init__(self) -> None:
        super().__init__("--supervised needs a pipe, socket or terminal as standard input")


class BadSigningKey(SitlError):
    """A line of a key file that is no key.

    Args:
        path: the file.
        line: its number, from 1; its text is a secret.
    """

    def __init__(self, path: Path, line: int) -> None:
        super().__init__(
            f"--signing-key {path}:{line}: expected 64 hexadecimal digits, not all zero, "
            "alone in the file or each behind a system id"
        )


class BadParameterFile(SitlError):
    """A line of a parameter file that is no parameter.

    Args:
        path: the file.
        line: its number, from 1.
        expected: what should stand there.
        found: what does.
    """

    def __init__(self, path: Path, line: int, expected: str, found: str) -> None:
        super().__init__(f"--parameters {path}:{line}: expected {expected}, found {found!r}")


class BadSigningFile(SitlError):
    """A stored key or its timestamps cannot be read; what is in the file is not shown."""

    def __init__(self, path: Path) -> None:
        super().__init__(f"{path}: expected what this simulator has stored about signing, found something else")
