"""Takes turns: at once when something has changed, or at the time that the last turn wanted.

A task that waits for an event with a time limit would do the same, a tenth of a millisecond later.
"""

import asyncio
from collections.abc import Callable

TIMER_S = 0.001
"""Resolution of the event loop's timers in s; shorter waits would be busy waiting."""
INFINITE = float("inf")


class Turns:
    """Calls `turn` while it runs; one per link.

    `turn` returns the time in s until the next turn, 0 for at once. `has_timer`: whether a turn may
    be due by time alone; without, only `wake` leads to one.
    """

    def __init__(self, turn: Callable[[], float], has_timer: Callable[[], bool]) -> None:
        self._turn = turn
        self._has_timer = has_timer
        self._over: asyncio.Future[None] | None = None
        self._soon: asyncio.Handle | None = None
        self._later: asyncio.TimerHandle | None = None

    async def run(self) -> None:
        """Take turns until cancelled. Raises what a turn raises."""
        self._over = asyncio.get_running_loop().create_future()
        self.wake()
        try:
            await self._over
        finally:
            self._over = None
            self._forget()

    def wake(self) -> None:
        """Take a turn as soon as the event loop is free."""
        if self._over is not None and self._soon is None:
            self._soon = self._over.get_loop().call_soon(self._take)

    def _take(self) -> None:
        over = self._over
        self._forget()
        if over is None or over.done():
            return
        try:
            wait_s = self._turn()
        except Exception as error:
            over.set_exception(error)
            return
        if not wait_s:
            self.wake()
        elif wait_s != INFINITE and self._has_timer():
            self._later = over.get_loop().call_later(max(TIMER_S, wait_s), self._take)

    def _forget(self) -> None:
        for handle in (self._soon, self._later):
            if handle is not None:
                handle.cancel()
        self._soon = self._later = None
