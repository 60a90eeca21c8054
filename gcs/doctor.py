"""`gcs doctor`: is everything here that a flight needs?"""

import importlib.metadata
import platform
import shutil
import socket
import sys
from collections.abc import Iterator
from dataclasses import dataclass

PACKAGES = ("numpy", "numba", "mavsdk", "pymavlink", "viser")
UDP_PORTS = {14550: "ground link", 14540: "first companion", 18570: "first simulated vehicle"}
PAGE_PORT = 8080
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "firefox")


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at."""

    what: str
    found: str
    fine: bool


def examine() -> Iterator[Finding]:
    """Look at versions, ports and browsers, one after the other."""
    version = platform.python_version()
    yield Finding("python", f"{version} on {platform.system()} {platform.machine()}", sys.version_info >= (3, 11))
    for name in PACKAGES:
        yield _package(name)
    for port, what in UDP_PORTS.items():
        yield _port(port, what, socket.SOCK_DGRAM)
    yield _port(PAGE_PORT, "web page", socket.SOCK_STREAM)
    browser = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    yield Finding("browser", browser or "none found; any browser on this machine will do", True)


def _package(name: str) -> Finding:
    try:
        return Finding(name, importlib.metadata.version(name), True)
    except importlib.metadata.PackageNotFoundError:
        return Finding(name, "not installed: run `make install`", False)


def _port(port: int, what: str, kind: socket.SocketKind) -> Finding:
    with socket.socket(socket.AF_INET, kind) as probe:
        try:
            probe.bind(("127.0.0.1", port))
        except OSError as problem:
            return Finding(f"port {port}", f"{what}: {problem.strerror} (is another flight running?)", False)
    return Finding(f"port {port}", f"{what}: free", True)
