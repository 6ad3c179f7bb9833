"""The test radio: compiles its driver from tests/soapy_loopback, and names its buses."""

import os
import subprocess
import sys
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.absent import PeerError

ROOT = Path(__file__).parents[1]
SHARED_MEMORY = Path("/dev/shm")


class NoDriverError(PeerError):
    """The driver cannot be compiled here; the message is the reason."""


def use_driver() -> None:
    """Make our processes load this driver and no other. Raises NoDriverError."""
    command = [sys.executable, "-m", "tests.soapy_loopback"]
    built = subprocess.run(command, check=False, cwd=ROOT, capture_output=True, text=True)
    if built.returncode:
        raise NoDriverError(built.stderr.strip().splitlines()[-1])
    os.environ["SOAPY_SDR_PLUGIN_PATH"] = built.stdout.strip()
    os.environ["SOAPY_SDR_ROOT"] = "/nonexistent"


@contextmanager
def a_bus() -> Iterator[str]:
    """The name of an air that no other process uses."""
    name = f"bench-{uuid.uuid4().hex[:12]}"
    try:
        yield name
    finally:
        (SHARED_MEMORY / f"soapy-loopback-{name}").unlink(missing_ok=True)
