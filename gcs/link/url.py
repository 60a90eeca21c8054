"""Connection strings in both grammars: `udpin:0.0.0.0:14550` and `udpin://0.0.0.0:14550`.

A budget may follow: `serial:///dev/ttyUSB0:57600?bytes_s=4000`.
"""

import re
from dataclasses import dataclass
from enum import Enum

from gcs.errors import UsageError

SERIAL_SHARE = 0.8
"""Of a serial line's 10 bits per byte, what is used."""


class Scheme(Enum):
    """How a connection is made."""

    UDP_IN = "udpin"
    """Bind here and answer whoever sends."""
    UDP_OUT = "udpout"
    """Send there first."""
    TCP = "tcp"
    """Connect there, and again when it breaks."""
    TCP_IN = "tcpin"
    """Bind here and take in whoever connects."""
    SERIAL = "serial"
    """A device; the port is its baud rate."""


@dataclass(frozen=True)
class LinkUrl:
    """One connection: scheme, host (or device) and port (or baud rate), and what it may carry."""

    scheme: Scheme
    host: str
    port: int
    budget_bytes_s: float | None = None

    def __str__(self) -> str:
        return f"{self.scheme.value}://{self.host}:{self.port}"


_NETWORK = re.compile(r"^(?P<scheme>udpin|udpout|tcp|tcpin):(?://)?(?P<host>[^:/]*):(?P<port>\d+)$")
_SERIAL = re.compile(r"^(?P<scheme>serial):(?://)?(?P<host>[^:]+):(?P<port>\d+)$")
_BUDGET = re.compile(r"^(?P<url>[^?]+)\?bytes_s=(?P<budget>\d+(?:\.\d+)?)$")


def parse_link_url(text: str) -> LinkUrl:
    """Read a connection string; an empty host means 127.0.0.1, and a serial line's budget comes from its baud rate.

    Raises:
        UsageError: naming what was expected and found.

    Example:
        >>> parse_link_url("udpin:0.0.0.0:14550") == parse_link_url("udpin://0.0.0.0:14550")
        True
    """
    url, budget_bytes_s = text.strip(), None
    if with_budget := _BUDGET.match(url):
        url, budget_bytes_s = with_budget["url"], float(with_budget["budget"])
    match = _NETWORK.match(url) or _SERIAL.match(url)
    serial = match is not None and match["scheme"] == Scheme.SERIAL.value
    if match is None or int(match["port"]) < 1 or (not serial and int(match["port"]) > 65535) or budget_bytes_s == 0.0:
        known = ", ".join(f"{scheme.value}://HOST:PORT" for scheme in Scheme if scheme is not Scheme.SERIAL)
        raise UsageError(f"--link {text}: expected one of {known}, serial:///dev/DEVICE:BAUD")
    if serial and budget_bytes_s is None:
        budget_bytes_s = SERIAL_SHARE * int(match["port"]) / 10
    return LinkUrl(Scheme(match["scheme"]), match["host"] or "127.0.0.1", int(match["port"]), budget_bytes_s)
