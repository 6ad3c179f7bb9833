"""Asks the kernel for a short scheduler slice for one thread.

Linux 6.12 and newer let an ordinary thread that runs briefly go first if its slice is short; older
kernels ignore the request. Threads of a benchmark ask for it, so that a row shows the daemon's
lateness and not that of its producer or consumer.
"""

import ctypes
import os
import platform
import struct

SLICE_NS = 100_000
SCHED_SETATTR = {"x86_64": 314, "aarch64": 274}
"""Number of the system call, by machine."""
ATTRIBUTES = struct.Struct("<IIQiIQQQ")
"""size, policy, flags, nice, priority, runtime, deadline, period: struct sched_attr, version 0."""


def take_short_slice() -> bool:
    """Request a slice of SLICE_NS for the calling thread; returns whether the kernel accepted it.

    The thread stays an ordinary one of the same nice value. Its later children inherit the slice.
    """
    number = SCHED_SETATTR.get(platform.machine())
    if number is None:
        return False
    nice = os.getpriority(os.PRIO_PROCESS, 0)
    wanted = ATTRIBUTES.pack(ATTRIBUTES.size, os.SCHED_OTHER, 0, nice, 0, SLICE_NS, 0, 0)
    return bool(ctypes.CDLL(None).syscall(number, 0, wanted, 0) == 0)
