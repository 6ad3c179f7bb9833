"""The tiers of the suite: what runs in parallel, and what is reported at the end."""

import signal

import pytest
from hypothesis import settings

from tests.laws import law
from tests.machine import left_out


def pytest_configure() -> None:
    """A shell's background job ignores SIGINT, and so would all processes that tests start."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    # Tests that do not state how many examples they need.
    settings.register_profile("law", law())
    settings.load_profile("law")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run real-time tests last, one after the other, when the other workers are done.

    A daemon takes a second to start: a test that starts one is slow, unless it is marked as quick.
    """
    for item in items:
        starts = "start_daemon" in getattr(item, "fixturenames", ())
        if starts and not item.get_closest_marker("quick"):
            item.add_marker(pytest.mark.slow)
        if item.get_closest_marker("realtime"):
            item.add_marker(pytest.mark.xdist_group("realtime"))
    items.sort(key=lambda item: item.get_closest_marker("realtime") is not None)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Report in one line what was skipped, and what it needs."""
    skipped = terminalreporter.stats.get("skipped", [])
    if line := left_out([report.longrepr[2].removeprefix("Skipped: ") for report in skipped]):
        terminalreporter.write_line(line)
