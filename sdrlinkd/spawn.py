"""Starts a modem process. A daemon may do so before it has loaded anything else.

The process loads its compiled code meanwhile, so both are ready in half the time.
"""

import contextlib
import mmap
import os
import socket
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import NamedTuple

from sdrlinkd.errors import UserError
from sdrlinkd.files import read_bounded

SOCKET_BYTES = 1 << 20
WITHOUT_MODEM = ("direct", "gnuradio")
"""Backends that carry PDUs without a modem."""
LATER = ("ether",)
"""Backends of which only their hub knows whether they need a process."""


class Spawned(NamedTuple):
    """A modem process, our end of its socket, and the descriptor of its page."""

    process: subprocess.Popen[bytes]
    control: socket.socket
    page: int

    def close(self) -> None:
        """End a process that is not needed."""
        self.control.close()
        os.close(self.page)
        self.process.kill()
        self.process.wait()


def spawn_modem() -> Spawned:
    """Start a modem process. Raises OSError."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    page = os.memfd_create("sdrlinkd-modem")
    os.ftruncate(page, mmap.PAGESIZE)
    for end in (ours, theirs):
        end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SOCKET_BYTES)
    inherited = [theirs.fileno(), page]
    try:
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", "sdrlinkd.modem.process", *map(str, inherited)],
            stdin=subprocess.DEVNULL,
            # It finds the modules that this process finds, and no others.
            env={**os.environ, "PYTHONPATH": os.pathsep.join(each or "." for each in sys.path)},
            pass_fds=inherited,
        )
    except OSError:
        ours.close()
        os.close(page)
        raise
    finally:
        theirs.close()
    ours.setblocking(False)
    return Spawned(process, ours, page)


class EarlyModem:
    """A modem process that was started early, for the first modem that wants one."""

    def __init__(self, spawned: Spawned | None = None) -> None:
        self._spawned = spawned

    def take(self) -> Spawned | None:
        """The process, once; None: there is none."""
        spawned, self._spawned = self._spawned, None
        return spawned

    def close(self) -> None:
        """End the process if nobody has taken it."""
        if (spawned := self.take()) is not None:
            spawned.close()


def spawn_early(config: Path) -> EarlyModem:
    """Start a modem process, if a look at the file shows that its radio will need one."""
    with contextlib.suppress(OSError, ValueError, UserError):
        raw = tomllib.loads(read_bounded(config).decode())
        backend = raw.get("backend", "direct")
        if isinstance(backend, str) and backend not in (*WITHOUT_MODEM, *LATER):
            section = raw.get(backend, {})
            if isinstance(section, dict) and section.get("paced", True) is True:
                return EarlyModem(spawn_modem())
    return EarlyModem()
