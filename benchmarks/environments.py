"""Virtual environments for peers that need packages of their own, created on first use.

They are kept in the user's cache. An rclpy from wheels starts each interpreter of its environment
twice, with other library paths, so it must not share an environment with our own packages.
"""

import fcntl
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Protocol

from benchmarks.absent import PeerError

ROOT = Path(__file__).parents[1]
"""The folder that contains the package `benchmarks`."""

BRIDGE = ROOT / "ros/sdrlink_ros"
"""The folder of the ROS 2 package."""

PACKAGES = {
    "zenoh": ["eclipse-zenoh"],
    "ros": [
        "ros-jazzy-rclpy[fastrtps]", "ros-jazzy-nav-msgs", "ros-jazzy-sensor-msgs",
        "ros-jazzy-geometry-msgs", "ros-jazzy-std-msgs", "ros-jazzy-test-msgs",
        "ros-jazzy-diagnostic-msgs", "ros-jazzy-std-srvs", "pyzmq",
    ],
    "mavlink": ["pymavlink==2.4.50"],
}  # fmt: skip
CHECKS = {
    "zenoh": "import zenoh",
    "ros": "import rclpy, std_msgs.msg, test_msgs.msg; rclpy.init()",
    "mavlink": "import pymavlink.dialects.v20.common",
}
WHEELS = (3, 11)
"""The only Python version that the rclpy wheels support."""
INSTALL_S = 600.0


class EnvironmentLackingError(PeerError):
    """An environment is not available; the message says why."""


class NeedsEnvironment(Protocol):
    """A peer with an environment; "" is our own."""

    @property
    def environment(self) -> str:
        """The name of the virtual environment that it needs."""


def unavailable(peers: Mapping[str, NeedsEnvironment], peer: str) -> str | None:
    """Why a peer cannot run here, or None if it can; creates the environment that it needs."""
    if peer not in peers:
        return f"no peer is called {peer!r}; there are {', '.join(peers)}"
    return _lacking(peers[peer].environment, _folder())


@cache
def _lacking(environment: str, _of: Path) -> str | None:
    try:
        interpreter(environment)
    except EnvironmentLackingError as error:
        return str(error)
    return None


def _folder() -> Path:
    """Where the environments are."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "sdrlinkd-bench"


def interpreter(environment: str) -> str:
    """The Python interpreter for endpoints; "" is ours. Creates a missing environment (slow)."""
    if not environment:
        return sys.executable
    cache = _folder()
    folder = cache / environment
    python, made = folder / "bin" / "python", folder / ".made"
    try:
        cache.mkdir(parents=True, exist_ok=True)
        with (cache / f"{environment}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not made.exists():
                _make(environment, folder)
                made.touch()
    except OSError as error:
        raise EnvironmentLackingError(f"{environment}: {error}") from None
    return str(python)


def variables(tree: Path = ROOT) -> dict[str, str]:
    """The environment variables of an endpoint, without any that would affect the measurement.

    `tree` is the checkout whose code it runs.
    """
    # Variables that an rclpy environment passes to its children would break others.
    kept = {
        key: value
        for key, value in os.environ.items()
        if key not in ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE", "VIRTUAL_ENV")
        and not key.startswith(("PYTHON", "ROS_", "RMW_", "FASTDDS_", "FASTRTPS_", "ZENOH_"))
    }
    return kept | {"PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}


def in_domain(domain: int) -> dict[str, str]:
    """Environment variables of a ROS program in `domain`, on this host alone.

    Its PYTHONPATH has the bridge and this checkout.
    """
    return {
        "PYTHONPATH": os.pathsep.join((str(BRIDGE), str(ROOT))),
        "ROS_DOMAIN_ID": str(domain),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }


def _make(environment: str, folder: Path) -> None:
    base = _base(environment)
    steps = [
        [base, "-m", "venv", "--clear", str(folder)],
        [str(folder / "bin" / "pip"), "install", "--quiet", "--no-compile", *PACKAGES[environment]],
        [str(folder / "bin" / "python"), "-c", CHECKS[environment]],
    ]
    for step in steps:
        try:
            done = subprocess.run(
                step,
                check=False,
                capture_output=True,
                text=True,
                env=variables(),
                timeout=INSTALL_S,
            )
        except subprocess.TimeoutExpired:
            took = f"not done within {INSTALL_S:.0f} s"
            raise EnvironmentLackingError(f"{environment}: {_what(step)}: {took}") from None
        if done.returncode:
            said = (done.stderr.strip().splitlines() or ["no reason given"])[-1]
            raise EnvironmentLackingError(f"{environment}: {_what(step)}: {said}")


def _what(step: list[str]) -> str:
    return " ".join([Path(step[0]).name, *step[1:]])


def _base(environment: str) -> str:
    if environment != "ros" or sys.version_info[:2] == WHEELS:
        return sys.executable
    version = ".".join(map(str, WHEELS))
    found = shutil.which(f"python{version}")
    if found is None:
        raise EnvironmentLackingError(f"rclpy: its wheels need Python {version}, which is not here")
    return found
