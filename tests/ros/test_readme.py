"""The first block of README's ROS 2 section, and that of docs/ros.md, as printed.

Only the ROS 2 distribution is another one here: rclpy from wheels instead of /opt/ros.
"""

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from sdrlinkd.process import Process
from tests.docs.pages import ROOT, blocks
from tests.ros.programs import Agent, new_domain
from tests.ros.team import TEXT, WAIT_S
from tests.ros.wheels import environment, python
from tests.waiting import wait_for

pytestmark = [pytest.mark.realtime, pytest.mark.long]


SDRLINKD = Path(sys.executable).parent / "sdrlinkd"


def borrow(theirs, ours):
    """Give an environment what the system has where ROS 2 is installed."""
    for folder in ("lib/python3.11/site-packages", "lib", "share"):
        (ours / folder).mkdir(exist_ok=True)
        for path in (theirs / folder).glob("*"):
            if not (ours / folder / path.name).exists():
                (ours / folder / path.name).symlink_to(path)


@pytest.mark.parametrize("page", ["README.md", "docs/ros.md"])
def test_the_bridge_comes_up_as_printed_and_a_topic_appears(page, start, tmp_path):
    _, text = blocks(page, "sh")[0]
    domain = new_domain()
    here = environment(domain) | {
        "HOME": str(tmp_path), "SDRLINKD_RUNTIME_DIR": str(tmp_path / "run"),
        "XDG_STATE_HOME": str(tmp_path / "state"),
    }  # fmt: skip
    here["PATH"] = f"{Path(python()).parent}:{os.environ['PATH']}"
    # The bridge is that which the block installs, not that of this checkout.
    del here["PYTHONPATH"]
    running = []
    lines = text.strip().splitlines()
    if not lines[0].startswith(".venv/bin/sdrlinkd"):
        # The page has its reader write a configuration above.
        lines.insert(0, ".venv/bin/sdrlinkd &")
    try:
        for line in lines:
            if line.startswith((". /opt/ros", "ros2 ")):
                continue
            typed = line.removesuffix("&").strip()
            if typed.startswith(".venv/bin/"):
                typed = typed.replace(".venv/bin/sdrlinkd", shlex.quote(str(SDRLINKD)))
            if line.endswith("&") or "-m sdrlink_ros" in line:
                running.append(
                    Process(
                        ["/bin/sh", "-c", f"exec {typed}"], name=typed, environment=here,
                        folder=ROOT,
                    )
                )  # fmt: skip
                running[-1].start()
                continue
            done = subprocess.run(
                typed, shell=True, cwd=ROOT, env=here, capture_output=True, text=True, check=False
            )
            assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"
            if " -m venv " in typed:
                borrow(Path(python()).parents[1], tmp_path / "sdrlink")
        node = start(Agent, domain, "talker")
        node.pub(topic="/chatter", type=TEXT)
        node.sub(topic="/robot_1/chatter", type=TEXT)

        def is_heard():
            assert all(each.is_running for each in running), [each.log() for each in running]
            node.send(topic="/chatter")
            return node.count(topic="/robot_1/chatter") > 0

        wait_for(is_heard, 2 * WAIT_S)
    finally:
        for each in reversed(running):
            each.stop()
