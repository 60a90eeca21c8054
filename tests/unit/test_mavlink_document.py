"""docs/mavlink.md names every message and command that the ground station and the companion use."""

import re
from pathlib import Path

from companion.link.messages import EVENTS_OF
from gcs.dialect import mavlink

ROOT = Path(__file__).parents[2]
DOCUMENT = (ROOT / "docs/mavlink.md").read_text()


def source_of(package: str) -> str:
    return "\n".join(path.read_text() for path in sorted((ROOT / package).rglob("*.py")))


def test_every_message_that_the_ground_station_builds_is_documented():
    built = re.findall(r"mavlink\.MAVLink_(\w+)_message", source_of("gcs"))
    missing = {name.upper() for name in built} - set(re.findall(r"[A-Z][A-Z_0-9]+", DOCUMENT))
    assert not missing
    assert len(set(built)) > 8


def test_every_message_that_the_ground_station_reads_is_documented():
    messages = {kind.msgname for kind in mavlink.mavlink_map.values()}
    named = set(re.findall(r'"([A-Z][A-Z_]+)"', source_of("gcs"))) & messages
    assert named - set(re.findall(r"[A-Z][A-Z_0-9]+", DOCUMENT)) == set()
    assert len(named) > 12


def test_every_command_is_documented_with_its_number():
    for package in ("gcs", "companion"):
        for name in set(re.findall(r"mavlink\.(MAV_CMD_\w+)", source_of(package))):
            number = getattr(mavlink, name)
            assert re.search(rf"\b{number}\b", DOCUMENT), f"{name} ({number}) of {package} is not in docs/mavlink.md"


def test_every_message_that_the_companion_reads_is_documented():
    assert set(EVENTS_OF) - set(re.findall(r"[A-Z][A-Z_0-9]+", DOCUMENT)) == set()
