"""Third-party recordings are not part of the project; SDRLINK_DATA names a folder of them."""

import os
from pathlib import Path

import pytest

DATA = os.environ.get("SDRLINK_DATA", "")
# Without them, nothing here is collected: these tests are optional, not skipped.
collect_ignore_glob = [] if DATA else ["test_*.py"]


@pytest.fixture(scope="session")
def data():
    """The folder; its README describes each file."""
    return Path(DATA).resolve()
