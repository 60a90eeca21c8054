"""Every kind of record that our programs write is explained, and what is explained is written."""

import re
from pathlib import Path

from gcs.flight import journal
from tests.unit.documentation.changed_tree import ROOT

PAGE = (ROOT / "docs/logs.md").read_text()


def explained(section: str) -> set[str]:
    """The names in the first column of a section's table."""
    (rows,) = re.findall(rf"^## {re.escape(section)}\n(.*?)(?=^## |\Z)", PAGE, re.M | re.S)
    firsts = [row.split(" | ")[0] for row in rows.splitlines() if row.startswith("| `")][1:]
    return {name for first in firsts for name in re.findall(r"`([^`]+)`", first)}


def written(package: str, *patterns: str) -> set[str]:
    sources = [path.read_text() for path in Path(ROOT / package).rglob("*.py")]
    return {name for text in sources for pattern in patterns for name in re.findall(pattern, text)}


def test_every_kind_of_event_is_explained():
    kinds = written("gcs", r'\bevents\.add\(\s*"([\w ]+)"') | {"began", "disk"}
    assert explained("events.jsonl") == kinds


def test_every_decision_of_a_companion_is_explained():
    notes = written(
        "companion", r'\bNote\("([^"]+)"', r'journal\.write\(self\._now_s, "([^"]+)"', r'else "(sensor \w+)"'
    )
    assert explained("companion-I.jsonl") == notes


def test_every_record_of_the_journal_is_explained():
    kinds = (journal.Began, journal.Planned, journal.Progressed, journal.Stored, journal.Ended)
    assert explained("journal.jsonl") == {kind.__struct_config__.tag for kind in kinds}
