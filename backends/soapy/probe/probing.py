"""Probes devices in a process of its own: a crashing driver ends only that process."""

import subprocess
import sys

import msgspec

from backends.base import BackendError
from backends.soapy.probe.report import ProbeReport

PATIENCE_S = 90.0
"""Generous, because some devices load their firmware first."""


def probe_devices(args: str = "") -> ProbeReport:
    """Probe the devices that match `args`; "" matches all. Raises BackendError."""
    try:
        done = subprocess.run(
            [sys.executable, "-m", "backends.soapy.probe", args],
            capture_output=True,
            check=False,
            timeout=PATIENCE_S,
        )
    except subprocess.TimeoutExpired:
        raise BackendError(
            f"a driver did not answer for {PATIENCE_S:g} s; name one device, such as driver=hackrf"
        ) from None
    if done.returncode:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        how = f"signal {-done.returncode}" if done.returncode < 0 else "; ".join(said[-1:])
        raise BackendError(
            f"a driver crashed ({how}); name one device, such as driver=hackrf, to find which"
        )
    # Drivers may print anything before the report.
    return msgspec.json.decode(done.stdout.splitlines()[-1], type=ProbeReport)
