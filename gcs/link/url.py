"""Connection strings in both grammars: `udpin:0.0.0.0:14550` and `udpin://0.0.0.0:14550`."""

import re
from dataclasses import dataclass
from enum import Enum

from gcs.errors import UsageError


class Scheme(Enum):
    """How a connection is made."""

    UDP_IN = "udpin"
    """Bind here and answer whoever sends."""
    UDP_OUT = "udpout"
    """Send there first."""


@dataclass(frozen=True)
class LinkUrl:
    """One connection: scheme, host and port."""

    scheme: Scheme
    host: str
    port: int

    def __str__(self) -> str:
        return f"{self.scheme.value}://{self.host}:{self.port}"


_URL = re.compile(r"^(?P<scheme>[a-z]+):(?://)?(?P<host>[^:/]*):(?P<port>\d+)$")


def parse_link_url(text: str) -> LinkUrl:
    """Read a connection string; an empty host means 127.0.0.1.

    Raises:
        UsageError: naming what was expected and found.

    Example:
        >>> parse_link_url("udpin:0.0.0.0:14550") == parse_link_url("udpin://0.0.0.0:14550")
        True
    """
    match = _URL.match(text.strip())
    schemes = {scheme.value: scheme for scheme in Scheme}
    if match is None or match["scheme"] not in schemes or not 0 < int(match["port"]) < 65536:
        known = ", ".join(f"{name}://HOST:PORT" for name in schemes)
        raise UsageError(f"--link {text}: expected one of {known}")
    return LinkUrl(schemes[match["scheme"]], match["host"] or "127.0.0.1", int(match["port"]))
