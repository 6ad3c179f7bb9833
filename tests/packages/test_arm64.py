"""The package for 64-bit ARM, by qemu. `make fresh` runs it: it takes half an hour."""

import json
import shutil
import sys

import pytest

from tests.machine import lacks
from tests.packages.debian import BUILDER, ROOT, Debian, call, lacking

DEMO = "sdrlinkctl demo --link ofdm"
COMPILED = "--engine compiled --duration 2 --speed 0.1 --rate 2e5"
NUMPY = "--engine numpy --duration 1 --speed 0.01 --rate 2e4 --topics /cmd_vel"
"""Qemu takes some ten times as long, and NumPy beside compiled code as much again."""


@pytest.mark.fresh
def test_the_package_for_64_bit_arm_installs_and_delivers_every_message(tmp_path):
    if why := lacking():
        pytest.skip(why)
    if shutil.which("qemu-aarch64-static") is None:
        pytest.skip(lacks("qemu-user-static"))
    # The host's compiler makes the modem; under qemu it would take as long as all the rest.
    call(sys.executable, "-m", "sdrlinkd.cli", "phy", "compile", "--for", "aarch64", cwd=ROOT)
    builder = Debian.new(tmp_path / "builder", *BUILDER, is_arm64=True)
    clone = builder.path / "root/sdrlinkd"
    call("git", "clone", "--quiet", "--no-hardlinks", ROOT, clone)
    shutil.copytree(ROOT / "phy/engine/libraries", clone / "phy/engine/libraries")
    builder.run("make -C sdrlinkd deb")
    (deb,) = (clone / "dist").glob("sdrlinkd_*_arm64.deb")
    robot = Debian.new(tmp_path / "robot", is_arm64=True)
    robot.install(deb)
    for engine in (COMPILED, NUMPY):
        robot.run(f"{DEMO} {engine}", user="robot")
        report = json.loads((robot.path / "home/robot/build/demo/report.json").read_text())
        assert [each["pdr"] for each in report["runs"]] == [1.0]
