"""Starts the daemons of a benchmark, and the hub of their air, as separate programs."""

import contextlib
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from benchmarks import processes
from benchmarks.absent import PeerError
from benchmarks.environments import ROOT
from sdrlinkd.client import ControlClient, NoDaemonError
from sdrlinkd.process import Process, ProcessError, wait_until

START_S = 90.0
LOOK_S = 0.2
QUIET = ("--log-level", "warning")
TYPE = "std_msgs/UInt8MultiArray"
TYPES = {"odom": "nav_msgs/Odometry"}
"""Message types of topics that have one."""
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
    """Folders of the daemons' sockets by robot, the folder of their air, and the processes."""

    folders: dict[int, Path]
    air: Path
    processes: list[Process]


def hears_one(daemon: ControlClient) -> bool:
    """Whether the daemon hears another robot."""
    return bool(daemon.ask("peers"))


def is_up(daemon: ControlClient) -> bool:
    """Whether the daemon's radio works."""
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
    tree: Path = ROOT,
    hooks: Mapping[str, str] = processes.NO_HOOKS,
) -> Iterator[Running]:
    """Run daemons, from when all of them are `ready`. Raises PeerError.

    `config` is TOML for all of them, `own` for single robots; `scenario` is for the hub of an
    ether. With `precede` they have priority over other programs on this machine. `tree` is the
    checkout whose programs are run, with `hooks` as for `start_module`.
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
        started = []
        for program, arguments in programs.items():
            started.append(
                processes.start_module(stack, program, *arguments, tree=tree, hooks=hooks)
            )
            if precede:
                processes.precede(started[-1], real_time=False)
        folders = {robot: folder / str(robot) for robot in robots}
        wait_for(folders, started, ready)
        yield Running(folders, folder / "air", started)


@contextmanager
def daemon_at_work(config: Path, tree: Path = ROOT) -> Iterator[Path]:
    """Run one daemon of the checkout `tree`, from when its link is up. Raises PeerError.

    Its sockets are beside `config`.
    """
    with ExitStack() as stack:
        daemon = processes.start_module(
            stack, "daemon", "sdrlinkd", "--config", str(config), *QUIET, tree=tree
        )
        wait_for({1: config.parent}, [daemon], is_up)
        yield config.parent


def wait_for(
    folders: dict[int, Path], started: list[Process], ready: Callable[[ControlClient], bool]
) -> None:
    """Wait until all daemons are `ready`. Raises PeerError, with what the programs have logged."""
    waiting = list(folders.values())

    def are_ready() -> bool:
        # Daemons become ready in turn; a ready one stays ready.
        with contextlib.suppress(NoDaemonError, OSError):
            while waiting:
                with ControlClient(waiting[-1]) as control:
                    if not ready(control):
                        break
                waiting.pop()
        return not waiting

    try:
        wait_until(are_ready, START_S, *started, every_s=LOOK_S)
    except ProcessError:
        words = "\n".join(f"{each.name}: {each.log().strip()}" for each in started)
        raise PeerError(f"the daemons did not become ready; {words}") from None
