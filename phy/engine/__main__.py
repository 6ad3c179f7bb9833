"""Compiles the kernels for a target into an object file: `python -m phy.engine TARGET FILE`."""

import sys
from pathlib import Path

from phy.engine.compile import write_object
from phy.engine.targets import TARGETS


def _say(done: int) -> None:
    sys.stdout.write(f"{done}\n")
    sys.stdout.flush()


write_object(TARGETS[sys.argv[1]], Path(sys.argv[2]), _say)
