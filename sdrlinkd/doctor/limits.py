"""Checks the system's limits: real-time priority, memory, buffers of sockets and USB."""

import os
import resource
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from backends import may_lock_memory, take_short_slices
from sdrlinkd.doctor.finding import Finding, bad, good, good_if, none
from sdrlinkd.doctor.usb import is_networked

NETWORK_BUFFER = 24_912_805
"""Size in bytes of a receiving socket's buffer that UHD's manual recommends."""
USB_BUFFER_MB = 16
"""Memory in MB that the kernel must allow for USB transfers; a kernel limit of 0 means no limit."""
REALTIME = 10


class Granted(NamedTuple):
    """What the system grants to this user on this machine."""

    can_hurry: bool
    """Whether a thread can get real-time priority, as tried."""
    nice: int
    """Lowest niceness that this user may set."""
    shared_memory: bool
    """Whether shared memory for two processes is available."""
    files: int
    """Limit of open files, RLIMIT_NOFILE."""
    can_lock: bool
    """Whether a process may keep its memory in RAM."""
    short_slices: bool
    """Whether the kernel grants short time slices."""


def granted() -> Granted:
    """What this process and its children are granted."""
    best_nice = 20 - resource.getrlimit(resource.RLIMIT_NICE)[0]
    files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if os.geteuid() == 0:
        best_nice = -20
    return Granted(
        _can_hurry(), max(-20, best_nice), _can_share(), files, may_lock_memory(),
        take_short_slices(),
    )  # fmt: skip


def _can_hurry() -> bool:
    """Whether real-time priority is granted, as tried in a child process, which then ends."""
    code = f"import os; os.sched_setscheduler(0, os.SCHED_RR, os.sched_param({REALTIME}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)  # noqa: S603
    return done.returncode == 0


def _can_share() -> bool:
    try:
        os.close(os.memfd_create("sdrlinkd-doctor"))
    except OSError:
        return False
    return True


def check_limits(granted: Granted, device: str, root: Path) -> list[Finding]:
    """Findings on whether priority, memory, files and buffers suffice.

    `device` has the form of soapy.device, "" without a radio. `root` is / or a copy of its /proc
    and /sys.
    """
    return [
        _hurry(granted, is_needed=bool(device)),
        _lock(granted, is_needed=bool(device)),
        _slices(granted),
        good_if(
            granted.shared_memory, "shared memory", "for samples between daemon and radio process",
            "memfd_create is forbidden here: check the container's seccomp profile",
        ),
        good_if(
            granted.files >= 256, "open files", f"{granted.files} allowed", "ulimit -n 1024",
        ),
        _buffer(device, root),
    ]  # fmt: skip


def _hurry(granted: Granted, *, is_needed: bool) -> Finding:
    what = "real-time priority"
    if granted.can_hurry:
        return good(what, "granted")
    instead = f"not granted; niceness down to {granted.nice}"
    if not is_needed:
        return none(what, f"{instead}; only the process of a real radio uses it")
    return bad(
        what, instead,
        "the systemd unit has LimitRTPRIO=50; by hand: `@sdrlink - rtprio 50` in "
        "/etc/security/limits.d/sdrlinkd.conf and log in again",
    )  # fmt: skip


def _lock(granted: Granted, *, is_needed: bool) -> Finding:
    what = "locked memory"
    if granted.can_lock:
        return good(what, "granted")
    if not is_needed:
        return none(what, "not granted; only the process of a real radio uses it")
    return bad(
        what, "not granted: the modem waits for the disk if memory is scarce",
        "the systemd unit has LimitMEMLOCK=infinity; by hand: `@sdrlink - memlock unlimited` in "
        "/etc/security/limits.d/sdrlinkd.conf and log in again",
    )  # fmt: skip


def _slices(granted: Granted) -> Finding:
    what = "time slices"
    if granted.short_slices:
        return good(what, "0.1 ms, for daemon and modem")
    return none(what, "this kernel grants no short ones, as Linux 6.12 and later do")


def _buffer(device: str, root: Path) -> Finding:
    what = "radio's buffers"
    if not device:
        return none(what, "no real radio is configured")
    if is_networked(device):
        limit = _number(root / "proc/sys/net/core/rmem_max")
        if limit is None:
            return none(what, "the kernel does not show net.core.rmem_max")
        return good_if(
            limit >= NETWORK_BUFFER, what, f"net.core.rmem_max = {limit}",
            f"sudo sysctl -w net.core.rmem_max={NETWORK_BUFFER} (and in /etc/sysctl.d)",
        )  # fmt: skip
    limit = _number(root / "sys/module/usbcore/parameters/usbfs_memory_mb")
    if limit is None:
        return none(what, "the kernel does not show usbfs_memory_mb")
    return good_if(
        limit == 0 or limit >= USB_BUFFER_MB, what, f"{limit} MB of kernel memory for USB",
        f"echo {USB_BUFFER_MB} | sudo tee /sys/module/usbcore/parameters/usbfs_memory_mb",
    )  # fmt: skip


def _number(path: Path) -> int | None:
    try:
        return int(path.read_text())
    except (OSError, ValueError):
        return None
