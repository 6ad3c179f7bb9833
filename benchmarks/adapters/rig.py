"""The rig of these benchmarks: a daemon without a modem, and programs where rclpy is."""

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.daemons import daemon_at_work
from benchmarks.environments import in_domain
from benchmarks.processes import start_module
from sdrlinkd.process import Process

CONFIG = '[bus]\nruntime_dir = "{folder}"\n'
DOMAINS = 100


@contextmanager
def daemon() -> Iterator[Path]:
    """A daemon that hears itself, without a modem; its runtime directory."""
    with TemporaryDirectory(prefix="benchmark-") as folder:
        config = Path(folder) / "sdrlinkd.toml"
        config.write_text(CONFIG.format(folder=folder))
        with daemon_at_work(config) as directory:
            yield directory


@contextmanager
def programs() -> Iterator[Callable[..., Process]]:
    """Starts modules where rclpy is, in a domain of this benchmark's own, and stops them."""
    hooks = in_domain(1 + os.getpid() % DOMAINS)
    with ExitStack() as stack:

        def start(module: str, *arguments: object) -> Process:
            given = (str(each) for each in arguments)
            return start_module(stack, module, module, *given, environment="ros", hooks=hooks)

        yield start
