"""docs/ground-link-promises.md names tests that there are."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROMISES = (ROOT / "docs/ground-link-promises.md").read_text()


def test_every_promise_of_the_ground_link_has_a_test_that_is_there():
    source = "\n".join(path.read_text() for path in sorted((ROOT / "tests").rglob("test_*.py")))
    tests = set(re.findall(r"def (test_\w+)\(", source))
    named = set(re.findall(r"`(test_\w+)`", PROMISES))
    assert len(named) > 60
    assert named - tests == set()


def test_no_promise_is_without_proof():
    rows = [line for line in PROMISES.splitlines() if line.startswith("| ") and "shown by" not in line]
    assert [row for row in rows if not re.search(r"`(test_\w+|make [a-z-]+)`", row)] == []
