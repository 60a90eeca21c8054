"""docs/compatibility.md promises nothing that no test holds, and forgets no test of another program."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[3]
DOCUMENT = (ROOT / "docs" / "compatibility.md").read_text(encoding="utf-8")


def names_of_tests_with_other_programs() -> set[str]:
    files = re.findall(r"`(tests/integration/test_\w+\.py)`", DOCUMENT)
    return {
        name for file in files for name in re.findall(r"^(?:async )?def (test_\w+)", (ROOT / file).read_text(), re.M)
    }


def test_every_row_names_tests_that_exist_and_every_test_has_its_row():
    named = set(re.findall(r"`(test_\w+)`", DOCUMENT))
    assert named == names_of_tests_with_other_programs()


def test_versions_are_the_ones_that_are_installed():
    pinned = dict(line.split("==") for line in (ROOT / "constraints.txt").read_text().splitlines() if "==" in line)
    assert f"| {pinned['mavsdk']} |" in DOCUMENT
    assert f"| {pinned['MAVProxy']} |" in DOCUMENT
