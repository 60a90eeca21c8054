"""Where the Chromium for the browser tests is, and how it is started without a screen and a graphics card.

As a program (`python -m tests.browser.chromium`) it tries to install playwright's own where there is no other.
"""

import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

ARGUMENTS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


@cache
def find_chromium() -> Path | None:
    """$CHROMIUM, the system's browser, or the one that playwright has installed."""
    if chosen := os.environ.get("CHROMIUM"):
        return Path(chosen) if Path(chosen).exists() else None
    for name in NAMES:
        if found := shutil.which(name):
            return Path(found)
    return _of_playwright()


def _of_playwright() -> Path | None:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        path = Path(playwright.chromium.executable_path)
    return path if path.exists() else None


def main() -> None:
    """Try to have a Chromium; the tests say so where there is none in the end."""
    if find_chromium() is None:
        print("no Chromium found; trying to install playwright's own")
        try:
            subprocess.run([sys.executable, "-m", "playwright", "install", "chromium"], timeout=300.0, check=False)
        except subprocess.TimeoutExpired:
            print("playwright install chromium: gave up after 300 s")


if __name__ == "__main__":
    main()
