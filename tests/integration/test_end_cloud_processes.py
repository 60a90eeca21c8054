"""The loop in flight with the real programs: an obstacle that no map shows, and a ground link that is cut meanwhile."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.integration import programs

pytestmark = pytest.mark.processes

MISSION = "indoor-unmapped"
FLIGHT_S = 120.0


def flown(directory: Path, *arguments: str) -> dict[str, Any]:
    """The report of a flight that has kept its promises, by the truth log."""
    ports = ("--instance-base", str(programs.instance_base()))
    order = ("gcs", "fly", MISSION, "--sim", "--headless", "--speed", "2", "--report", str(directory))
    finished = programs.run(*order, *ports, *arguments, timeout_s=FLIGHT_S)
    assert finished.code == 0, finished.output
    assert programs.promises_broken(directory, MISSION) == []
    report = programs.report_of(directory)
    assert report["success"]
    return report


def kinds(directory: Path) -> list[str]:
    """What has happened, in order."""
    return [json.loads(line)["kind"] for line in (directory / "events.jsonl").read_text().splitlines()]


def test_an_obstacle_that_no_map_shows_is_seen_avoided_and_planned_around(tmp_path: Path):
    report = flown(tmp_path)
    assert report["cloud_replans"] >= 1
    assert "swapped" in kinds(tmp_path)


def test_with_the_ground_link_cut_in_the_middle_the_companions_avoid_it_alone(tmp_path: Path):
    report = flown(tmp_path, "--fault", "link:link=ground,blackout_s=10,at_s=10")
    assert all(vehicle["offboard_losses"] == 0 for vehicle in report["vehicles"])
