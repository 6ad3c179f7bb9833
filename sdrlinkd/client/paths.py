"""Where the daemon's sockets are."""

import os
import socket
from pathlib import Path

IN_SOCKET = "in.sock"
IN_PUB_SOCKET = "in-pub.sock"
OUT_SOCKET = "out.sock"
CONTROL_SOCKET = "ctl.sock"

SYSTEM_DIR = Path("/run/sdrlinkd")


def runtime_dir(given: str | os.PathLike[str] | None = None) -> Path:
    """The daemon's runtime directory: `given`, or the default.

    The default is $SDRLINKD_RUNTIME_DIR, else the system service's directory (/run/sdrlinkd) if it
    runs, else the user's own.
    """
    chosen = given or os.environ.get("SDRLINKD_RUNTIME_DIR")
    if chosen:
        return Path(chosen)
    if is_there(SYSTEM_DIR / CONTROL_SOCKET):
        return SYSTEM_DIR
    base = os.environ.get("XDG_RUNTIME_DIR")
    return Path(base) / "sdrlinkd" if base else Path(f"/tmp/sdrlinkd-{os.getuid()}")  # noqa: S108


def chosen_dir(
    runtime_dir_: str | os.PathLike[str] | None, directory: str | os.PathLike[str] | None
) -> Path:
    """The runtime directory, given under either name. Raises TypeError if both are given."""
    if runtime_dir_ is not None and directory is not None:
        raise TypeError("runtime_dir and directory mean the same; give only runtime_dir")
    return runtime_dir(directory if runtime_dir_ is None else runtime_dir_)


def is_there(path: Path) -> bool:
    """Whether `path` exists; False where this user is not allowed to look."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def is_prepared(directory: Path) -> bool:
    """Whether another user may have prepared `directory` to answer in place of a daemon.

    That is so if it belongs to neither this user nor root, and anybody may write beside it, as in
    /tmp.
    """
    try:
        about, beside = directory.lstat(), directory.absolute().parent.stat()
    except (OSError, ValueError):
        return False
    return about.st_uid not in (0, os.getuid()) and bool(beside.st_mode & 0o002)


def endpoint(directory: Path, socket: str) -> str:
    """The ZeroMQ endpoint of a socket in the runtime directory."""
    return f"ipc://{directory / socket}"


def is_open(path: Path) -> bool:
    """Whether a program accepts connections at the socket `path`."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        # A backlog that is full is that of a program which is there.
        probe.setblocking(False)
        try:
            probe.connect(os.fspath(path))
        except BlockingIOError:
            return True
        except (OSError, ValueError):
            return False
    return True
