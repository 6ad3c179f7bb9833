"""Prepares a checkout, so that its daemons find everything compiled."""

import subprocess
import sys
from argparse import ArgumentTypeError
from pathlib import Path

from benchmarks.environments import interpreter, variables
from benchmarks.processes import told_by

PACKAGES = ("sdrlinkd", "backends", "phy")


def checkout(name: str) -> Path:
    """The checkout in the folder `name`, for the command line. Raises ArgumentTypeError."""
    path = Path(name).resolve()
    if missing := [each for each in PACKAGES if not (path / each / "__init__.py").exists()]:
        raise ArgumentTypeError(f"got {name}, which has no {missing[0]}; allowed: a checkout")
    return path


def prepare(tree: Path) -> None:
    """Compile a checkout's modules and kernels, where they are not. Raises PeerError."""
    command = [interpreter(""), "-m", "compileall", "-q", *PACKAGES]
    subprocess.run(command, check=False, cwd=tree, env=variables(tree), stdout=sys.stderr)
    told_by("compiling", interpreter(""), "-c", "import phy; phy.warm_up()", tree=tree)
