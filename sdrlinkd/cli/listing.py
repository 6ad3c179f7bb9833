"""`list`: lists the daemons of this host.

A running daemon listens on its control socket, and the kernel lists all listening sockets. So no
registration is needed, and nothing can be stale.
"""

import contextlib
import os
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import msgspec
import typer

from sdrlinkd.asking import ask_status
from sdrlinkd.cli.app import AsJson, app, connect
from sdrlinkd.cli.screens import daemons_table
from sdrlinkd.client import CONTROL_SOCKET, IN_SOCKET, OUT_SOCKET, NoDaemonError, RefusedError
from sdrlinkd.client import runtime_dir as usual_directory
from sdrlinkd.reports import Snapshot
from sdrlinkd.tables import screen_console

SOCKETS = Path("/proc/net/unix")
LISTENS = 0x10000
"""Linux's __SO_ACCEPTCON flag of a listening socket."""
SOCKET_NAMES = (CONTROL_SOCKET, IN_SOCKET, OUT_SOCKET)
PATIENCE_S = 1.0
LOCK = "lock"
"""File with the daemon's process id, in the folder of its sockets."""


class Listed(NamedTuple):
    """A daemon; if it does not answer, `snapshot` is None and `problem` says why."""

    directory: Path
    pid: int | None
    snapshot: Snapshot | None
    problem: str = ""


@app.command("list")
def list_daemons(as_json: AsJson = False) -> None:
    """List the daemons of this host."""
    found = [_look(directory) for directory in directories()]
    if as_json:
        typer.echo(msgspec.json.encode([_told(each) for each in found]).decode())
        return
    if not found:
        typer.echo("no sdrlinkd runs on this host; start one: sdrlinkd --config FILE")
        return
    console = screen_console()
    rows = [(str(each.directory), each.pid, each.snapshot or each.problem) for each in found]
    console.print(daemons_table(rows, console.width))


def directories() -> list[Path]:
    """Runtime directories in which a program listens on all three sockets."""
    try:
        lines = SOCKETS.read_text(errors="surrogateescape").splitlines()[1:]
    except OSError:
        # This kernel does not list sockets, so use only the usual directory.
        return [usual_directory()]
    listening = set(_listening(lines))
    return sorted(
        path.parent
        for path in listening
        if path.name == CONTROL_SOCKET
        and {path.parent / name for name in SOCKET_NAMES} <= listening
    )


def _listening(lines: Iterable[str]) -> Iterable[Path]:
    """Paths of the listening sockets.

    Each line has the form: Num RefCount Protocol Flags Type St Inode Path.
    """
    for line in lines:
        parts = line.split(maxsplit=7)
        # A name that begins with @ is an abstract socket, not a file.
        if len(parts) < 8 or not int(parts[3], 16) & LISTENS or parts[7].startswith("@"):
            continue
        path = Path(parts[7])
        if path.is_absolute():
            yield path
        elif path.name in SOCKET_NAMES:
            yield from _resolved(path)


def _resolved(path: Path) -> Iterable[Path]:
    """Absolute paths of a socket whose daemon used a path relative to its working directory."""
    for link in Path("/proc").glob("[0-9]*/cwd"):
        with contextlib.suppress(OSError):
            whole = link.readlink() / path
            if whole.is_socket():
                yield whole


def _look(directory: Path) -> Listed:
    snapshot, problem = None, "no answer"
    if not os.access(directory / CONTROL_SOCKET, os.W_OK):
        problem = "this user has no access"
    try:
        with connect(directory, PATIENCE_S) as control:
            snapshot = ask_status(control)
    except (NoDaemonError, RefusedError, msgspec.ValidationError):
        pass
    try:
        pid = int((directory / LOCK).read_text())
    except (OSError, ValueError):
        pid = None
    return Listed(directory, pid, snapshot, problem)


def _told(each: Listed) -> dict[str, object]:
    at = each.snapshot
    return {
        "runtime_dir": str(each.directory),
        "pid": each.pid,
        "node": at.node if at else None,
        "namespace": at.namespace if at else None,
        "verdict": at.verdict if at else None,
        "backend": at.carrier.kind if at else None,
        "state": at.carrier.state if at else None,
        "uptime_s": at.uptime_s if at else None,
        "version": at.version if at else None,
        "problem": None if at else each.problem,
    }
