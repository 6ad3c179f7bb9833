"""Log lines for the journal."""

import logging
import os
import subprocess
import sys
from pathlib import Path

from sdrlinkd.journal import JournalFormatter

ROOT = Path(__file__).parents[1]


def test_every_line_has_its_priority():
    record = logging.LogRecord("x", logging.WARNING, "", 0, "one\ntwo", (), None)
    assert JournalFormatter("%(message)s").format(record) == "<4>one\n<4>two"


def test_only_the_journal_gets_priorities(tmp_path):
    """$JOURNAL_STREAM is inherited by programs with another stderr."""
    code = "from sdrlinkd.journal import is_read_by_journal as it; print(it())"
    log = tmp_path / "log"
    with log.open("w") as stream:
        found = os.fstat(stream.fileno())
        for told, expected in (
            (f"{found.st_dev}:{found.st_ino}", "True"), ("1:1", "False"), ("", "False"),
        ):  # fmt: skip
            done = subprocess.run(
                [sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, stderr=stream,
                text=True, check=True, env={**os.environ, "JOURNAL_STREAM": told},
            )  # fmt: skip
            assert done.stdout.strip() == expected
