"""What the command lines of benchmarks and experiments have in common."""

import argparse
import os
import platform
import re
from pathlib import Path


def seed_range(text: str) -> range:
    """`A:B`, from A up to but not including B; a type for argparse.

    Raises:
        argparse.ArgumentTypeError: it is none, or empty.

    Example:
        >>> seed_range("3:5")
        range(3, 5)
    """
    found = re.fullmatch(r"(\d{1,9}):(\d{1,9})", text, re.ASCII)
    if found is None or int(found[1]) >= int(found[2]):
        raise argparse.ArgumentTypeError(f"expected A:B with A < B, found {text!r}")
    return range(int(found[1]), int(found[2]))


def machine() -> str:
    """What times were measured on; with more load than cores they are longer than they should be."""
    names = re.findall(r"^model name\s*: (.*)$", Path("/proc/cpuinfo").read_text(encoding="ascii"), re.MULTILINE)
    model = names[0] if names else platform.processor()
    return f"{model}, {os.cpu_count()} cores, load average {os.getloadavg()[0]:.1f}, Python {platform.python_version()}"
