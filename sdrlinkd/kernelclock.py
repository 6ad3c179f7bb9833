"""What the kernel says of this host's clock: whether it is synchronized, and how well."""

import ctypes
from typing import NamedTuple

_UNSYNCHRONIZED = 0x0040
_ERROR = 5


class KernelClock(NamedTuple):
    """The kernel's state of this host's clock; `error_s` is the largest error in s."""

    is_synchronized: bool
    error_s: float


class _Timex(ctypes.Structure):
    """struct timex of adjtimex(2), with the fields that we read; the rest is padding."""

    _fields_ = (
        ("modes", ctypes.c_uint),
        ("offset", ctypes.c_long),
        ("frequency", ctypes.c_long),
        ("max_error", ctypes.c_long),
        ("estimated_error", ctypes.c_long),
        ("status", ctypes.c_int),
        ("room", ctypes.c_char * 512),
    )


def kernel_clock() -> KernelClock | None:
    """The kernel's clock state by adjtimex(2), which changes nothing here; None if unavailable."""
    timex = _Timex()
    try:
        state = ctypes.CDLL(None, use_errno=True).adjtimex(ctypes.byref(timex))
    except (AttributeError, OSError):
        return None
    if state < 0:
        return None
    is_synchronized = state != _ERROR and not timex.status & _UNSYNCHRONIZED
    return KernelClock(is_synchronized, 1e-6 * timex.max_error)


def is_synchronized() -> bool:
    """Whether this host's clock is synchronized, by NTP or similar."""
    kernel = kernel_clock()
    return kernel is not None and kernel.is_synchronized
