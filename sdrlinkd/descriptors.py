"""File descriptors: as many as the system allows, and no new connections when they run out.

libzmq ends the process if it cannot open one for a connection, so the daemon must stop listening
before. `ulimit -n` and LimitNOFILE set the limit.
"""

import asyncio
import contextlib
import logging
import os
import resource
import time
from collections.abc import Callable
from math import inf
from pathlib import Path
from typing import Protocol

from sdrlinkd.errors import UserError

log = logging.getLogger("sdrlinkd")

LEAST = 1024
"""Fewest descriptors with which a daemon starts; it needs some 50 itself."""
FULL = 0.9
"""Share of the limit in use at which listening ends."""
SPARE = 512
"""Least descriptors that are free when listening ends: as many programs may connect in SOON_S."""
CLOSED_S = 1.0
"""Shortest time in s without listening."""
TOLD_S = 60.0
FEW = 16_384
SOON_S, SELDOM_S = 0.02, 1.0
"""Times in s between two counts, for limits below FEW and for others."""
_OPEN = Path("/proc/self/fd")
_UNLIMITED = 1 << 20


def raise_limit() -> int:
    """Allow this process all descriptors that it may have; returns how many. Raises UserError."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = _UNLIMITED if hard == resource.RLIM_INFINITY else hard
    if most < LEAST:
        raise UserError(
            f"descriptors: this process may have {most}; allowed: at least {LEAST} "
            "(ulimit -n, or LimitNOFILE= in the unit)"
        )
    if soft < most:
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
    return resource.getrlimit(resource.RLIMIT_NOFILE)[0]


class Listen(Protocol):
    """Begins or ends to accept connections."""

    def __call__(self, *, is_on: bool) -> None:
        """Accept connections, or not."""


class Descriptors:
    """Ends and resumes listening by the number of open descriptors; `limit` is the most of them.

    When libzmq stops listening at a socket, it also closes the connections that it has accepted
    there. Programs connect again by themselves when they can.
    """

    def __init__(
        self,
        limit: int,
        listen: Listen,
        count: Callable[[], int] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._limit = limit
        self._most = min(FULL * limit, limit - SPARE)
        self._listen = listen
        self._count = count or _open_now
        self._clock = clock
        self._is_closed = False
        self._closed_at = -inf

    def look(self) -> None:
        """Count the open descriptors, and stop or resume listening."""
        now = self._clock()
        if self._is_closed:
            if now - self._closed_at >= CLOSED_S and self._count() < self._most:
                self._is_closed = False
                self._listen(is_on=True)
        elif self._count() >= self._most:
            if not self.notices():
                log.error("%s", self._told)
            self._is_closed, self._closed_at = True, now
            self._listen(is_on=False)

    async def watch(self) -> None:
        """Look again and again, forever."""
        while True:
            await asyncio.sleep(SOON_S if self._limit < FEW else SELDOM_S)
            self.look()

    def notices(self) -> list[str]:
        """What a person should know for a minute after connections were closed."""
        return [self._told] if self._clock() - self._closed_at < TOLD_S else []

    @property
    def _told(self) -> str:
        return (
            f"{self._most:.0f} of the {self._limit} descriptors were in use, so all programs were "
            "cut off; they connect again. End some, or raise LimitNOFILE"
        )


def _open_now() -> int:
    try:
        return len(os.listdir(_OPEN))  # noqa: PTH208  # in half the time
    except OSError:
        return 0
