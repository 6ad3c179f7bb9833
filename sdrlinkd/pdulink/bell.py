"""A bell that wakes a link that has nothing to send."""

import asyncio
import contextlib


class Bell:
    """Rung when there may be something to send; while nobody waits, it is remembered."""

    def __init__(self) -> None:
        self._rung = asyncio.Event()

    def ring(self) -> None:
        """Wake who waits, or whoever waits next."""
        self._rung.set()

    def hush(self) -> None:
        """Forget what it was rung for until now."""
        self._rung.clear()

    async def wait(self, most_s: float) -> None:
        """Wait until it is rung, for at most so many seconds, which may be infinite."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(None if most_s == float("inf") else most_s):
                await self._rung.wait()
