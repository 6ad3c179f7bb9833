"""Asks the kernel to run what handles samples in time: short slices, real-time priority, memory.

Nothing here is necessary: what the kernel refuses, it refuses, and everything works, later.
"""

import contextlib
import ctypes
import os
import platform
import resource
import struct
import time
from pathlib import Path

SLICE_NS = 100_000
"""Length of a time slice in ns: the thread waits shorter for its turn, and gets less at a time."""
REALTIME, NICE = 10, -10
"""Real-time priority (SCHED_RR), or else niceness."""
ADVICE = (
    "the modem has no real-time priority: other programs delay it; the systemd unit grants it, by "
    "hand: `@sdrlink - rtprio 50` in /etc/security/limits.d/sdrlinkd.conf, then log in again"
)
LOCKED_BYTES = 1 << 28
"""Memory that a process with compiled code may come to need, and so must be allowed to lock."""

# Numbers of sched_setattr and sched_getattr, by the machine's instruction set.
_CALLS = {"x86_64": (314, 315), "aarch64": (274, 275), "armv7l": (380, 381)}
# struct sched_attr, sched_setattr(2): size, policy, flags, nice, priority, runtime, deadline,
# period.
_ATTRIBUTES = struct.Struct("=IIQiIQQQ")
_TIMER_SLACK = 29
"""PR_SET_TIMERSLACK, prctl(2)."""
_LOCK_ALL = 3
"""MCL_CURRENT | MCL_FUTURE, mlockall(2)."""

_libc = ctypes.CDLL(None, use_errno=True)


def take_short_slices() -> bool:
    """Ask for slices of SLICE_NS and exact timers, for this thread and those that it starts.

    Needs no privilege. Returns whether the kernel grants the slice: Linux 6.12 and later do.
    """
    _libc.prctl(_TIMER_SLACK, 1, 0, 0, 0)
    calls = _CALLS.get(platform.machine())
    if calls is None or os.sched_getscheduler(0) != os.SCHED_OTHER:
        return False
    nice = os.getpriority(os.PRIO_PROCESS, 0)
    wanted = _ATTRIBUTES.pack(_ATTRIBUTES.size, os.SCHED_OTHER, 0, nice, 0, SLICE_NS, 0, 0)
    if _libc.syscall(calls[0], 0, wanted, 0):
        return False
    found = ctypes.create_string_buffer(_ATTRIBUTES.size)
    if _libc.syscall(calls[1], 0, found, _ATTRIBUTES.size, 0):
        return False
    # Older kernels accept the call and ignore the slice.
    return bool(_ATTRIBUTES.unpack(found.raw)[5] == SLICE_NS)


class Scheduling:
    """How the kernel runs this process; with `is_urgent`, the process has real-time priority.

    A process that uses a whole core at real-time priority leaves nothing to others, so it gives the
    priority up for a second (`yields`). `look` is to be called several times a second.
    """

    BUDGET = 0.9
    """Share of a core that a process at real-time priority may use."""
    SPAN_S = 1.0
    """Span in s over which this is measured, and for which the priority is given up."""

    def __init__(self, *, is_urgent: bool) -> None:
        self._has_slices = take_short_slices()
        self._is_urgent = is_urgent
        self._has_priority = is_urgent and hurry()
        self._is_locked = is_urgent and lock_memory()
        self._is_resting = False
        self._since_s, self._cpu_s = time.monotonic(), time.process_time()
        self.yields = 0
        """How often the priority was given up."""

    @property
    def told(self) -> str:
        """What was granted, in words."""
        parts = ["short slices" if self._has_slices else "ordinary slices"]
        if self._is_urgent:
            parts.append("real-time priority" if self._has_priority else "no real-time priority")
            parts.append("locked memory" if self._is_locked else "memory not locked")
        return ", ".join(parts)

    @property
    def advice(self) -> str:
        """What a person could do about what was refused, in a sentence; empty: nothing."""
        return ADVICE if self._is_urgent and not self._has_priority else ""

    def look(self) -> None:
        """Give the priority up, or take it again, by the CPU time of the last second."""
        now_s = time.monotonic()
        if not self._has_priority or now_s < self._since_s + self.SPAN_S:
            return
        cpu_s = time.process_time()
        used = (cpu_s - self._cpu_s) / (now_s - self._since_s)
        self._since_s, self._cpu_s = now_s, cpu_s
        if self._is_resting:
            self._is_resting = False
            _set_all(os.SCHED_RR, REALTIME)
        elif used > self.BUDGET:
            self._is_resting = True
            self.yields += 1
            _set_all(os.SCHED_OTHER, 0)


def _set_all(policy: int, priority: int) -> None:
    """Set the scheduling of all threads of this process."""
    for thread in Path("/proc/self/task").iterdir():
        # A thread may end meanwhile.
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.sched_setscheduler(int(thread.name), policy, os.sched_param(priority))


def hurry() -> bool:
    """Take real-time priority or, if that is refused, niceness; returns whether it is real time."""
    may, _ = resource.getrlimit(resource.RLIMIT_RTPRIO)
    try:
        if may >= REALTIME or os.geteuid() == 0:
            os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(REALTIME))
            return True
        os.setpriority(os.PRIO_PROCESS, 0, NICE)
    except PermissionError:
        pass
    return False


def may_lock_memory() -> bool:
    """Whether this process may keep all of its memory in RAM."""
    may, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    return may == resource.RLIM_INFINITY or may >= LOCKED_BYTES or os.geteuid() == 0


def lock_memory() -> bool:
    """Keep all memory of this process in RAM, if it may; returns whether it does."""
    return may_lock_memory() and not _libc.mlockall(_LOCK_ALL)
