"""Browsers come and go in the middle of everything, and the page's program does not grow."""

import re
import time
from pathlib import Path

import pytest

from tests.laws import often
from tests.programs import sdrlinkctl
from tests.waiting import wait_for
from tests.web.conftest import page_of

WARM_S = 30.0
MOST_GROWTH_KB = 16 << 10
"""The pictures' ten minutes fill up meanwhile, and Python keeps what it once had."""
VISIT_S = 4.0
GONE_S = 15.0
"""Time in s after which a browser that has gone is forgotten."""


def resident_kb(process):
    status = Path(f"/proc/{process.pid}/status").read_text()
    return int(re.search(r"VmRSS:\s*(\d+) kB", status)[1])


def n_open(process):
    """Its open files and sockets."""
    return len(list(Path(f"/proc/{process.pid}/fd").iterdir()))


def visit(url, open_browser, until):
    """Look at every view in turn, with a new browser each time, which is gone in mid-stream."""
    views = ("Map", "Link", "Air", "Topics")
    n = 0
    while time.monotonic() < until:
        browser = open_browser(url)
        browser.tab(views[n % len(views)])
        time.sleep(VISIT_S)
        browser.close()
        n += 1
    return n


def grows(lab, open_browser, for_s):
    folders = [word for n in (1, 2) for word in ("--runtime-dir", lab[1] / f"robot_{n}")]
    with sdrlinkctl("web", "--listen", "127.0.0.1:0", *folders) as page:
        url = page_of(page)
        visit(url, open_browser, time.monotonic() + WARM_S)
        time.sleep(GONE_S)
        idle = n_open(page)
        before_kb = resident_kb(page)
        assert visit(url, open_browser, time.monotonic() + for_s) > 2
        # The connections of browsers that have gone are closed.
        wait_for(lambda: n_open(page) <= idle + 4, 60.0)
        assert resident_kb(page) - before_kb < MOST_GROWTH_KB
        assert "Traceback" not in page.err()
        assert "Error" not in page.err(), page.err()


@pytest.mark.long
@pytest.mark.soak
def test_two_minutes_without_growth(lab, open_visitor):
    """Two minutes in all, and most of an hour in `make soak`."""
    grows(lab, open_visitor, often(90))
