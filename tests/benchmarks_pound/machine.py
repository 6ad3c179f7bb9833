"""What the peers need of the machine."""

import os
import shutil

import pytest

from benchmarks.peers.pound import namespaces
from tests.machine import ROOT as NO_ROOT
from tests.machine import lacks


def no_network():
    """Why no namespaces are available here; "" if they are."""
    if not shutil.which("tc"):
        return lacks("iproute2")
    if os.geteuid():
        return f"{NO_ROOT}, for network namespaces"
    return namespaces.available() or ""


in_namespaces = pytest.mark.skipif(bool(no_network()), reason=no_network())
