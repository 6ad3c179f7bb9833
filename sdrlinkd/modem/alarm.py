"""An alarm for the event loop that rings to the microsecond; the loop's own timers take 1 ms."""

import asyncio
import ctypes
import os
import struct
from collections.abc import Callable

_CLOCK_MONOTONIC = 1
# TFD_NONBLOCK | TFD_CLOEXEC, timerfd_create(2).
_FLAGS = os.O_NONBLOCK | os.O_CLOEXEC
# struct itimerspec: interval and first expiry, each in s and ns.
_SPEC = struct.Struct("@llll")
_COUNT_BYTES = 8
NS = 1_000_000_000

_libc = ctypes.CDLL(None, use_errno=True)


class Alarm:
    """Calls `ring` on the event loop. Raises OSError when the kernel has no more timers."""

    def __init__(self, ring: Callable[[], None]) -> None:
        self._ring = ring
        self._fd = _libc.timerfd_create(_CLOCK_MONOTONIC, _FLAGS)
        if self._fd < 0:
            raise OSError(ctypes.get_errno(), "timerfd_create")
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._fd, self._rung)

    def set(self, seconds: float) -> None:
        """Ring once in `seconds`, and not when it was set to ring before; more than 0."""
        spec = _SPEC.pack(0, 0, *divmod(max(1, round(seconds * NS)), NS))
        _libc.timerfd_settime(self._fd, 0, spec, None)

    def close(self) -> None:
        """Ring no more."""
        self._loop.remove_reader(self._fd)
        os.close(self._fd)

    def _rung(self) -> None:
        try:
            os.read(self._fd, _COUNT_BYTES)
        except BlockingIOError:
            # It was set again meanwhile.
            return
        self._ring()
