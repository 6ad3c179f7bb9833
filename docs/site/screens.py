"""Makes the pictures in docs/screens: the page of `sdrlinkctl web`, and a drive's report.

`make figures` runs it. It needs Chromium and ChromeDriver.
"""

import os
import re
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.peers.browser import Browser
from sdrlinkd.process import Process, module

SCREENS = Path(__file__).parents[1] / "screens"
SIZE = (1180, 740)
REPORT_SIZE = (900, 2100)
WATCHED_S = 70
VIEWS = {
    "mine": {"map": "Map"},
    "three-robots": {"link": "Link", "air": "Air", "topics": "Topics", "what-if": "What if"},
}
"""The views by scenario, with the names of their pictures."""


def main() -> int:
    """Make all of them."""
    _report()
    for scenario, views in VIEWS.items():
        with tempfile.TemporaryDirectory() as folder:
            _look(scenario, views, Path(folder))
    return 0


def _report() -> None:
    """The page of the scenario mine, in lock-step."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with Process(module("sdrlinkd.cli", "lab", "mine", "--out", folder / "out")) as lab:
            lab.wait(600)
        browser = Browser(folder / "profile", size=REPORT_SIZE)
        try:
            browser.open((folder / "out/report.html").as_uri())
            browser.picture(SCREENS / "report-mine.png")
        finally:
            browser.close()
    sys.stdout.write("wrote report-mine.png\n")


def _look(scenario: str, views: dict[str, str], folder: Path) -> None:
    options = ("--web", "--pace", "realtime", "--duration", "240", "--out", folder / "out")
    command = module("sdrlinkd.cli", "lab", scenario, *options)
    environment = {**os.environ, "TMPDIR": str(folder), "COLUMNS": "200"}
    with Process(command, environment=environment) as lab:
        while not (found := re.search(r"page at (http\S+)", lab.line())):
            pass
        browser = Browser(folder / "profile", size=SIZE)
        try:
            _take(browser, found[1], views)
        finally:
            browser.close()


def _take(browser: Browser, url: str, views: dict[str, str]) -> None:
    browser.open(url)
    time.sleep(WATCHED_S)
    for name, view in views.items():
        browser.tab(view)
        time.sleep(8)
        if view == "What if":
            browser.press("take the last minute")
            time.sleep(2)
        browser.picture(SCREENS / f"web-{name}.png")
        sys.stdout.write(f"wrote web-{name}.png\n")


if __name__ == "__main__":
    sys.exit(main())
