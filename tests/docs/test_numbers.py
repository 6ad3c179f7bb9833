"""Numbers that several pages repeat are those of the code, or at least the same everywhere."""

import re

import pytest

from docs.site.stage import documents
from sdrlinkd.config import Config
from sdrlinkd.offers import BEST_EFFORT, RELIABLE
from tests.docs.pages import ROOT

# What is said, how often at least, and the number of the code; None: that of the first page.
FACTS = [
    (r"declares? up to (\d+) (?:further |more |)topics", 1, 128),
    (r"up to (\d+) (?:more|further)\b", 1, 128),
    (r"others take (\d+) topics of a robot", 1, 128),
    (r"sent again(?: when they are lost)?[^.|]{0,40} for up to ([\d.]+) s", 1, 0.8),
    (r"at most ([\d.]+) % of the air \(`repeat\.share`\)", 1, 100 * Config().repeat.share),
    (r"best effort keeps\s+the last (\d+) messages", 1, BEST_EFFORT.depth),
    (r"reliable the last (\d+) for", 1, RELIABLE.depth),
    (r"Best effort has `depth` (\d+)", 1, BEST_EFFORT.depth),
    (r"reliable has `depth` (\d+)", 1, RELIABLE.depth),
    (r"(\d+) MB(?: of disk)? ?[;(]\s*1\.1 GB", 2, None),
    (r"http://127\.0\.0\.1:(\d+)/ *(?:`|:|$)", 1, 8420),
    (r"ws://127\.0\.0\.1:(\d+)", 1, 8765),
    (r"http://127\.0\.0\.1:(\d+)/metrics", 1, 9477),
    (r"`bus\.max_message_bytes`[^|]*\| (\d+) MiB|(\d+) MiB \| `bus\.max_message_bytes`", 1,
     Config().bus.max_message_bytes >> 20),
    (r"`reassembly\.timeout_s`[^|]*\| ([\d.]+) s|([\d.]+) s \| `reassembly\.timeout_s`", 1,
     Config().reassembly.timeout_s),
    (r"takes? (one to \w+ minutes)|\((one to \w+ minutes),", 3, None),
]  # fmt: skip


@pytest.mark.parametrize(("said", "least", "value"), FACTS, ids=lambda each: str(each)[:40])
def test_pages_say_the_same(said, least, value):
    found = [
        (page, next(filter(None, match.groups())))
        for page in documents()
        for match in re.finditer(said, " ".join((ROOT / page).read_text().split()))
    ]
    assert len(found) >= least, found
    wanted = found[0][1] if value is None else f"{value:g}"
    assert {number for _, number in found} == {wanted}, found
