"""The test radio does what its README says, as seen through the official binding."""

import os
import subprocess
from pathlib import Path

import pytest

from tests.machine import lacks
from tests.soapy_loopback import missing, module_folder

ROOT = Path(__file__).parents[2]
PYTHON = "/usr/bin/python3"


@pytest.mark.long
@pytest.mark.realtime
def test_driver_passes_its_checks():
    if why := missing():
        pytest.skip(why)
    probe = subprocess.run(["env", PYTHON, "-c", "import SoapySDR, numpy"], capture_output=True)
    if probe.returncode:
        pytest.skip(lacks("python3-soapysdr", "python3-numpy"))
    # With an empty root SoapySDR loads no other driver: this is faster, and quiet.
    where = {"SOAPY_SDR_PLUGIN_PATH": str(module_folder()), "SOAPY_SDR_ROOT": "/nonexistent"}
    done = subprocess.run(
        [PYTHON, "-m", "tests.soapy_loopback.check_driver"],
        cwd=ROOT,
        env=os.environ | where,
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert done.returncode == 0, done.stdout + done.stderr
