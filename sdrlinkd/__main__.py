"""The daemon's command line: `sdrlinkd --config FILE`."""

import argparse
import logging
import os
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from sdrlinkd import __version__, spawn
from sdrlinkd.descriptors import raise_limit
from sdrlinkd.errors import UserError
from sdrlinkd.journal import log_to_stderr
from sdrlinkd.parent import end_with_parent
from sdrlinkd.shipped import shipped_files

if TYPE_CHECKING:
    from sdrlinkd.config import Setup

DEFAULT_CONFIG = Path("/etc/sdrlinkd/sdrlinkd.toml")
SERVICE = "INVOCATION_ID"
"""Variable that systemd sets for a service."""
log = logging.getLogger("sdrlinkd")


def main(arguments: list[str] | None = None) -> int:
    """Run the daemon; returns 0 after a clean stop, 2 for errors that a person can fix."""
    end_with_parent()
    options = make_parser().parse_args(arguments)
    # Until the daemon can read its configuration again, a request to do so must not end it.
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    log_to_stderr(logging.getLevelNamesMapping()[options.log_level.upper()])
    try:
        path = options.config or _usual()
        if options.check:
            sys.stdout.write("\n".join([*_checked(_read(path)), ""]))
            return 0
        _run(path)
    except UserError as error:
        sys.stderr.write(f"sdrlinkd: {error}\n")
        return 2
    except KeyboardInterrupt:
        # Ctrl-C before the daemon has installed its own handler.
        return 130
    return 0


def _usual() -> Path:
    """The configuration where none is named: the host's, or that of a robot that hears itself.

    A service is never without its own.
    """
    alone = shipped_files("etc", "", ".toml").get("alone")
    if DEFAULT_CONFIG.exists() or SERVICE in os.environ or alone is None:
        return DEFAULT_CONFIG
    log.info(
        "without a configuration: robot 1 alone, which hears itself, as in %s; --config FILE names "
        "another one, and sdrlinkctl init writes one",
        alone,
    )
    return alone


def _run(path: Path) -> None:
    """Run the daemon. Raises UserError."""
    limit = raise_limit()
    early = spawn.spawn_early(path)
    try:
        # Loaded while the modem process loads its own code.
        import asyncio

        import uvloop

        from backends import take_short_slices
        from sdrlinkd import daemon

        take_short_slices()
        setup = _read(path)
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            runner.run(daemon.run(setup, lambda: _read(path), early, limit))
    finally:
        early.close()


def _read(path: Path) -> "Setup":
    from sdrlinkd.config import load_config, make_setup

    return make_setup(load_config(path), path.parent, str(path))


def _checked(setup: "Setup") -> list[str]:
    """The lines that `--check` prints about the configuration and the radio. Raises UserError."""
    from sdrlinkd import daemon, starting
    from sdrlinkd.config import unchecked

    told = daemon.check(setup)
    told += starting.try_start(setup, daemon.runtime_directory(setup.config))
    verdict = (
        "the file is valid; the daemon checks the rest when it starts"
        if unchecked(setup.config)
        else "the configuration is valid"
    )
    return [*setup.summary(), *told, verdict]


def make_parser() -> argparse.ArgumentParser:
    """The daemon's options."""
    parser = argparse.ArgumentParser(
        prog="sdrlinkd", description="ROS 2 messages between robots over software radio."
    )
    parser.add_argument(
        "--config", type=Path, metavar="FILE",
        help=f"configuration (TOML); default: {DEFAULT_CONFIG}, or else one robot that hears "
        "itself, for a first look",
    )  # fmt: skip
    parser.add_argument(
        "--check",
        action="store_true",
        help="check whether the daemon would start with it, print what follows, and exit",
    )
    parser.add_argument(
        "--log-level", choices=("debug", "info", "warning", "error"), default="info"
    )
    parser.add_argument("--version", action="version", version=f"sdrlinkd {__version__}")
    return parser


if __name__ == "__main__":
    sys.exit(main())
