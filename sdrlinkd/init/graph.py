"""Lists the topics of a running ROS 2 graph by ROS's own command line."""

import re
import shutil
import subprocess

from sdrlinkd.errors import UserError
from sdrlinkd.init.choosing import FoundTopic

PATIENCE_S = 30.0
_LINE = re.compile(r"(/\S+) \[([^\],]+)\]")


def topics_of_graph() -> list[FoundTopic]:
    """The topics that `ros2 topic list -t` lists, except those with several types.

    Raises UserError if this shell has no ROS 2.
    """
    program = shutil.which("ros2")
    if program is None:
        raise UserError(
            "--from-graph: `ros2` is not in PATH; source ROS 2's setup.bash first, or give "
            "--bag FILE or --topic NAME:TYPE"
        )
    try:
        done = subprocess.run(  # noqa: S603 (ROS's own program, with fixed arguments)
            [program, "topic", "list", "-t"],
            capture_output=True, text=True, check=False, timeout=PATIENCE_S,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as error:
        raise UserError(f"--from-graph: `ros2 topic list -t` does not answer ({error})") from None
    if done.returncode:
        said = " ".join(done.stderr.split())[-200:]
        raise UserError(f"--from-graph: `ros2 topic list -t` failed: {said}")
    return [FoundTopic(name, kind) for name, kind in _LINE.findall(done.stdout)]
