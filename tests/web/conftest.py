"""A lab that runs with its page, and browsers that look at it."""

import os
import re
import shutil
from pathlib import Path

import pytest

from benchmarks.peers.browser import Browser
from sdrlinkd.process import Process
from tests.machine import lacks
from tests.programs import sdrlinkctl

SCENARIO = """
title = "Two robots"
pace = "realtime"
duration_s = 20000.0
[air]
rate_hz = 1e6
snr_db = 25.0
[[robot]]
id = 1
[[robot]]
id = 2
topics = ["odom", "imu"]
[daemon.modem]
mcs = 3
[daemon.access]
policy = "tdma"
"""


def page_of(process: Process) -> str:
    """The address that a program with a page prints."""
    while True:
        found = re.search(r"page at (http\S+)", process.line())
        if found:
            return found[1]


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """A lab of two robots in real time: (address of its page, its folder with the daemons)."""
    folder = tmp_path_factory.mktemp("lab")
    (folder / "two.toml").write_text(SCENARIO)
    arguments = ("lab", folder / "two.toml", "--web", "--out", folder / "out")
    with sdrlinkctl(*arguments, environment=_below(folder)) as process:
        hint = process.line()
        while "--runtime-dir" not in hint:
            hint = process.line()
        runtime_dir = Path(re.search(r"--runtime-dir (\S+?),", hint)[1])
        yield page_of(process), runtime_dir.parent


def _below(folder):
    return {**os.environ, "TMPDIR": str(folder), "COLUMNS": "200"}


@pytest.fixture
def open_visitor(tmp_path):
    """Opens browsers, whatever they may complain about."""
    if shutil.which("chromium") is None or shutil.which("chromedriver") is None:
        pytest.skip(lacks("chromium", "chromium-driver"))
    opened = []

    def open_(url, **more):
        browser = Browser(tmp_path / f"profile_{len(opened)}", **more)
        opened.append(browser)
        browser.open(url)
        return browser

    yield open_
    for browser in opened:
        browser.close()


@pytest.fixture
def open_browser(open_visitor):
    """Opens browsers; what they complain about fails the test."""
    opened = []

    def open_(url, **more):
        opened.append(open_visitor(url, **more))
        return opened[-1]

    yield open_
    for browser in opened:
        assert browser.complaints() == []
