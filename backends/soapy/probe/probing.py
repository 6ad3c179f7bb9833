"""Probing devices in a process of its own: a driver that crashes takes only that with it."""

import subprocess
import sys

import msgspec

from backends.base import BackendError
from backends.soapy.probe.report import ProbeReport

PATIENCE_S = 90.0
"""Some devices load their firmware first."""


def probe_devices(args: str = "") -> ProbeReport:
    """Look at the devices that `args` names; "": all. Raises BackendError."""
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
    # Drivers print what they like before that.
    return msgspec.json.decode(done.stdout.splitlines()[-1], type=ProbeReport)
