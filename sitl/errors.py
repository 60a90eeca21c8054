"""What can go wrong for whoever starts the simulator."""


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


class BadPlace(SitlError):
    """An `--origin` that is no place.

    Args:
        text: what was given.
    """

    def __init__(self, text: str) -> None:
        super().__init__(f"--origin {text}: expected LAT,LON,ALT in degrees and metres, such as 47.3977,8.5456,489.4")
