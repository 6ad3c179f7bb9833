"""Daemons of a benchmark, and the hub of their air, as programs of their own."""

import time
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from benchmarks.processes import Child, PeerError
from sdrlinkd.client import ControlClient, NoDaemonError

START_S = 90.0
QUIET = ("--log-level", "warning")
TYPE = "std_msgs/UInt8MultiArray"
TYPES = {"odom": "nav_msgs/Odometry"}
"""Of topics with messages of their own."""
DAEMON = """namespace = "robot_{robot}"
registry = "registry.csv"
rx_depth = 0
backend = "{backend}"
[bus]
runtime_dir = "{folder}/{robot}"
[ether]
dir = "{folder}/air"
"""


class Running(NamedTuple):
    """Folders of the daemons' sockets by robot, that of their air, and the processes."""

    folders: dict[int, Path]
    air: Path
    children: list[Child]


def hears_one(daemon: ControlClient) -> bool:
    """Whether it hears another robot."""
    return bool(daemon.ask("peers"))


def is_up(daemon: ControlClient) -> bool:
    """Whether its radio works."""
    return bool(daemon.ask("status")["carrier"]["state"] == "up")


@contextmanager
def running(
    backend: str,
    robots: Collection[int],
    topics: Collection[str],
    config: str,
    scenario: str,
    *,
    precede: bool = False,
    own: Mapping[int, str] | None = None,
    ready: Callable[[ControlClient], bool] = hears_one,
) -> Iterator[Running]:
    """Until every daemon is `ready`, and then. Raises PeerError.

    `config` are TOML tables for each of them, `own` those of one; `scenario` is for the hub of an
    ether. With `precede` they go before what else this machine does.
    """
    with TemporaryDirectory(prefix="benchmark-") as name, ExitStack() as stack:
        folder = Path(name)
        lines = [f"{each},{TYPES.get(each, TYPE)}\n" for each in topics]
        (folder / "registry.csv").write_text("".join(lines))
        programs: dict[str, tuple[str, ...]] = {}
        if backend == "ether":
            path = folder / "scenario.toml"
            path.write_text(scenario)
            programs["hub"] = ("sdrlinkd.cli.ether", str(path), "--dir", str(folder / "air"))
        for robot in robots:
            path = folder / f"{robot}.toml"
            text = DAEMON.format(robot=robot, folder=folder, backend=backend) + config
            path.write_text(text + (own or {}).get(robot, ""))
            programs[f"daemon_{robot}"] = ("sdrlinkd", "--config", str(path), *QUIET)
        children = []
        for program, arguments in programs.items():
            children.append(stack.enter_context(Child(program, *arguments)))
            if precede:
                children[-1].precede(real_time=False)
        folders = {robot: folder / str(robot) for robot in robots}
        _wait_for(folders, children, ready)
        yield Running(folders, folder / "air", children)


def _wait_for(
    folders: dict[int, Path], children: list[Child], ready: Callable[[ControlClient], bool]
) -> None:
    until = time.monotonic() + START_S
    waiting = list(folders.values())
    while time.monotonic() < until and not any(child.has_ended for child in children):
        try:
            while waiting:
                with ControlClient(waiting[-1]) as control:
                    if not ready(control):
                        break
                waiting.pop()
            else:
                return
        except (NoDaemonError, OSError):
            pass
        time.sleep(0.2)
    words = "\n".join(f"{child.name}: {child.words()}" for child in children)
    raise PeerError(f"the daemons do not get ready; {words}")
