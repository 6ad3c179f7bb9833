"""The package as colcon installs it."""

import re
import shutil
import subprocess

import pytest

from benchmarks.environments import BRIDGE
from sdrlinkd import __version__
from tests.ros.wheels import environment, python


@pytest.mark.slow
def test_the_package_installs_what_ros_looks_for(ros, tmp_path):
    source, root = tmp_path / "source", tmp_path / "root"
    shutil.copytree(BRIDGE, source)
    subprocess.run(
        [
            python(), "setup.py", "-q", "install", "--root", root, "--prefix", "/usr",
            "--single-version-externally-managed", "--record", tmp_path / "record",
        ],
        cwd=source, check=True, capture_output=True, env=environment(1),
    )  # fmt: skip
    share = root / "usr/share"
    assert (share / "ament_index/resource_index/packages/sdrlink_ros").exists()
    assert (share / "sdrlink_ros/launch/bridge.launch.py").exists()
    assert (share / "sdrlink_ros/systemd/sdrlink-ros.service").exists()
    assert (root / "usr/lib/sdrlink_ros/bridge").exists(), "ros2 run looks there"
    package = (share / "sdrlink_ros/package.xml").read_text()
    assert re.findall("<version>(.*)</version>", package) == [__version__]
    assert f'version="{__version__}"' in (source / "setup.py").read_text()
