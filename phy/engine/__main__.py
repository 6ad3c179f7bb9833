"""Compiles the kernels for a target into an object file.

`python -m phy.engine TARGET FILE PARENT`: it ends together with the process PARENT, which waits.
"""

import ctypes
import os
import signal
import sys
from pathlib import Path

_PR_SET_PDEATHSIG = 1

# Before the imports, which take seconds, and before a kernel, which takes more.
if prctl := getattr(ctypes.CDLL(None), "prctl", None):
    prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
if os.getppid() != int(sys.argv[3]):
    sys.exit("nobody waits any more")

from phy.engine.compile import write_object  # noqa: E402
from phy.engine.targets import TARGETS  # noqa: E402


def _say(done: int) -> None:
    sys.stdout.write(f"{done}\n")
    sys.stdout.flush()


write_object(TARGETS[sys.argv[1]], Path(sys.argv[2]), _say)
