"""How long a row takes, and how it tells its figure."""

import os
import time

import pytest

SECONDS = float(os.environ.get("SDRLINK_SECONDS", "1.5"))


@pytest.fixture
def seconds():
    """How long a row loads or disturbs what it tests, in s."""
    return SECONDS


@pytest.fixture
def lasting(seconds):
    """Yields until the time of the row has passed."""

    def last():
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            yield until - time.monotonic()

    return last


@pytest.fixture
def figure(record_property):
    """Tells the row's figure: `figure(number, what, told)`."""

    def tell(number, what, told):
        record_property("scorecard", (number, what, told))

    return tell
