"""The tiers of the suite, and what is reported at the end."""

import json
import os
import signal
from pathlib import Path

import pytest
from hypothesis import settings

from tests.laws import law
from tests.machine import left_out

FRESH = "SDRLINK_FRESH"
"""Set by `make fresh`."""


def pytest_configure() -> None:
    """A shell's background job ignores SIGINT, and so would all processes that tests start."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    # Tests that do not state how many examples they need.
    settings.register_profile("law", law())
    settings.load_profile("law")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark slow tests: a daemon takes a second to start, unless a test is marked as quick.

    Those for `make fresh` run only there.
    """
    later = [] if os.environ.get(FRESH) else [i for i in items if i.get_closest_marker("fresh")]
    if later:
        config.hook.pytest_deselected(items=later)
        items[:] = [item for item in items if item not in later]
    for item in items:
        starts = "start_daemon" in getattr(item, "fixturenames", ())
        if starts and not item.get_closest_marker("quick"):
            item.add_marker(pytest.mark.slow)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Report in one line what was skipped, and what it needs."""
    skipped = terminalreporter.stats.get("skipped", [])
    rows = sorted(
        tuple(row)
        for report in terminalreporter.stats.get("passed", [])
        for name, row in getattr(report, "user_properties", ())
        if name == "scorecard"
    )
    if path := os.environ.get("SDRLINK_SCORECARD"):
        Path(path).write_text(json.dumps(rows))
    if line := left_out([report.longrepr[2].removeprefix("Skipped: ") for report in skipped]):
        terminalreporter.write_line(line)
