"""The runtime directory: whether a daemon can have its sockets there, and programs reach them."""

import os
import stat
from pathlib import Path

from sdrlinkd.doctor.finding import Finding, bad, good, good_if

MOST_BYTES = 95
"""A Unix socket's path has 107, the longest of our names takes 12."""
CONTROL = "ctl.sock"


def check_directory(path: Path, uid: int) -> list[Finding]:
    """`uid`: the user who runs the daemon."""
    what = "runtime directory"
    length = len(os.fsencode(path))
    if length > MOST_BYTES:
        return [
            bad(
                what, f"{path} has {length} bytes; a socket's path allows {MOST_BYTES}",
                "a shorter bus.runtime_dir",
            )
        ]  # fmt: skip
    if not path.exists():
        above = next((each for each in path.parents if each.exists()), Path("/"))
        return [
            good_if(
                os.access(above, os.W_OK | os.X_OK), what, f"{path}, made at start",
                f"{above} is not writable for this user: another bus.runtime_dir, or "
                "systemd's RuntimeDirectory=",
            )
        ]  # fmt: skip
    about = path.stat()
    if not stat.S_ISDIR(about.st_mode):
        return [bad(what, f"{path} is no directory", "another bus.runtime_dir")]
    if about.st_uid not in (0, uid) or (about.st_mode & 0o002 and not about.st_mode & 0o1000):
        return [
            bad(
                what, f"{path} belongs to another user, or is open to all",
                "a directory of this user's own as bus.runtime_dir",
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
    running = "; a daemon's sockets are there" if (path / CONTROL).exists() else ""
    return [good(what, told + running)]
