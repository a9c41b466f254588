"""docs/topics.md is the topic table of the code."""

from __future__ import annotations

from fulmar_core.robots.topics import WIRES
from tests.architecture.topics_page import DIRECTIONS, page, row

MAKE = "python -m tests.architecture.topics_page > docs/topics.md"


def test_page_is_generated_from_the_topic_table(repository):
    written = (repository / "docs" / "topics.md").read_text(encoding="utf-8")
    assert written == page(), f"docs/topics.md is out of date. Make it again: {MAKE}"


def test_page_has_every_topic_once():
    assert {wire.source for wire in WIRES} == set(DIRECTIONS)
    assert all(page().count(f"\n{row(wire)}\n") == 1 for wire in WIRES)
