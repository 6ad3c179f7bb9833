"""Opens the runtime directory and the sockets in it, without harm to another daemon."""

import fcntl
import os
import stat
from collections.abc import Mapping
from pathlib import Path

import zmq

from sdrlinkd.client import CONTROL_SOCKET, endpoint, is_open
from sdrlinkd.errors import BusError
from sdrlinkd.files import unwritable

LOCK_NAME = "lock"
# A Unix socket's path has at most 107 bytes, including the longest of our socket names.
MAX_DIRECTORY_BYTES = 107 - len("/in-pub.sock")


class RuntimeDirectory:
    """The directory of one daemon's sockets, locked for as long as the daemon runs.

    The lock is taken first, as ZeroMQ silently lets a second bind take over a live path.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        _refuse_long(path)
        try:
            path.mkdir(mode=0o750, parents=True, exist_ok=True)
            _refuse_foreign(path)
            flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW
            self._lock = os.open(path / LOCK_NAME, flags, 0o640)
        except OSError as error:
            raise _unusable(path, error.strerror) from None
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            owner = _owner(self._lock)
            os.close(self._lock)
            raise BusError(
                f"another sdrlinkd (pid {owner}) already runs in {path}; stop it, or give this "
                "one its own bus.runtime_dir"
            ) from None
        self._bound: list[Path] = []
        os.ftruncate(self._lock, 0)
        os.pwrite(self._lock, f"{os.getpid()}\n".encode(), 0)

    def bind(
        self,
        context: zmq.Context[zmq.Socket[bytes]],
        kind: int,
        name: str,
        options: Mapping[int, int | bytes],
    ) -> zmq.Socket[bytes]:
        """A socket bound to `name` in this directory, for owner and group only. Raises BusError."""
        path = self.path / name
        if is_open(path):
            raise BusError(
                f"{path} is in use by another program; stop it, or set another bus.runtime_dir"
            )
        bound = context.socket(kind)
        bound.linger = 0
        for option, value in options.items():
            bound.setsockopt(option, value)
        before = os.umask(0o007)
        try:
            bound.bind(endpoint(self.path, name))
        except zmq.ZMQError as error:
            bound.close()
            raise BusError(f"{path} cannot be bound: {error.strerror}") from None
        finally:
            os.umask(before)
        self._bound.append(path)
        return bound

    def unbind(self, bound: zmq.Socket[bytes], name: str) -> None:
        """Accept no new connections at a socket; those that exist stay."""
        bound.unbind(endpoint(self.path, name))

    def bind_again(self, bound: zmq.Socket[bytes], name: str) -> None:
        """Accept connections again at a socket that was unbound. Raises BusError."""
        before = os.umask(0o007)
        try:
            bound.bind(endpoint(self.path, name))
        except zmq.ZMQError as error:
            raise BusError(f"{self.path / name} cannot be bound: {error.strerror}") from None
        finally:
            os.umask(before)

    def close(self) -> None:
        """Remove the sockets that were bound here and release the lock."""
        for path in self._bound:
            path.unlink(missing_ok=True)
        os.ftruncate(self._lock, 0)
        os.close(self._lock)


def check_directory(path: Path) -> None:
    """Check that a daemon of this user can make its sockets in `path`. Raises BusError."""
    _refuse_long(path)
    if problem := unwritable(path):
        raise _unusable(path, problem)
    if path.exists():
        _refuse_foreign(path)


def running_in(path: Path) -> str:
    """The process id of the daemon whose sockets are in `path`; empty if there is none.

    Its lock is not tried, which would be in the way of a daemon that starts meanwhile.
    """
    if not is_open(path / CONTROL_SOCKET):
        return ""
    try:
        lock = os.open(path / LOCK_NAME, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW)
    except OSError:
        return "unknown"
    try:
        return _owner(lock)
    finally:
        os.close(lock)


def _owner(lock: int) -> str:
    return os.pread(lock, 32, 0).decode(errors="replace").strip() or "unknown"


def _unusable(path: Path, problem: str | None) -> BusError:
    return BusError(
        f"bus.runtime_dir: {path} is unusable ({problem}); name a directory that this user may "
        "write to"
    )


def _refuse_long(path: Path) -> None:
    length = len(os.fsencode(path))
    if length > MAX_DIRECTORY_BYTES:
        raise BusError(
            f"bus.runtime_dir: {path} has {length} bytes; a socket path allows "
            f"{MAX_DIRECTORY_BYTES}"
        )


def is_foreign(about: os.stat_result, uid: int) -> bool:
    """Whether users other than `uid` and root own a directory or may write to it.

    Such a user could have prepared the directory to intercept the sockets of user `uid`.
    """
    # In a sticky directory, as /tmp is, others can put links before us.
    return about.st_uid not in (0, uid) or bool(about.st_mode & 0o002)


def _refuse_foreign(path: Path) -> None:
    about = path.lstat()
    if stat.S_ISLNK(about.st_mode) and about.st_uid not in (0, os.getuid()):
        raise BusError(
            f"bus.runtime_dir: {path} is a link that another user has made; name a directory"
        )
    if is_foreign(path.stat(), os.getuid()):
        raise BusError(
            f"bus.runtime_dir: {path} belongs to another user or is open to all; name a directory "
            "that this user owns"
        )
