"""Checks the runtime directory: whether a daemon can make its sockets there."""

import os
import stat
from pathlib import Path

from sdrlinkd.bus import MAX_DIRECTORY_BYTES, is_foreign
from sdrlinkd.client import CONTROL_SOCKET
from sdrlinkd.doctor.finding import Finding, bad, good, good_if


def check_directory(path: Path, uid: int) -> list[Finding]:
    """Findings on whether a daemon of user `uid` can make its sockets in `path`."""
    what = "runtime directory"
    length = len(os.fsencode(path))
    if length > MAX_DIRECTORY_BYTES:
        return [
            bad(
                what, f"{path} has {length} bytes; a socket's path allows {MAX_DIRECTORY_BYTES}",
                "a shorter bus.runtime_dir",
            )
        ]  # fmt: skip
    if not path.exists():
        above = next((each for each in path.parents if each.exists()), Path("/"))
        return [
            good_if(
                os.access(above, os.W_OK | os.X_OK), what, f"{path}, created at start",
                f"{above} is not writable for this user: set another bus.runtime_dir, or "
                "systemd's RuntimeDirectory=",
            )
        ]  # fmt: skip
    about = path.stat()
    if not stat.S_ISDIR(about.st_mode):
        return [bad(what, f"{path} is not a directory", "another bus.runtime_dir")]
    if is_foreign(about, uid):
        return [
            bad(
                what, f"{path} belongs to another user, or is open to all",
                "set bus.runtime_dir to a directory that this user owns",
            )
        ]  # fmt: skip
    if not os.access(path, os.R_OK | os.X_OK):
        return [
            bad(
                what, f"{path} is closed to this user",
                "join the daemon's group: sudo usermod -aG sdrlink $USER, then log in again",
            )
        ]  # fmt: skip
    told = f"{path}, mode {stat.S_IMODE(about.st_mode):o}"
    running = "; holds a daemon's sockets" if (path / CONTROL_SOCKET).exists() else ""
    return [good(what, told + running)]
