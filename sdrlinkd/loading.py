"""The modem, compiled or loaded on a thread while the bus takes messages already."""

import asyncio
import logging
import threading

log = logging.getLogger("sdrlinkd")


class _GivenUpError(Exception):
    """Nobody waits for the modem any more."""


class Loading:
    """Loads the modem once, whoever waits or gives up; `told` is how far it is, for people."""

    def __init__(self) -> None:
        self._is_given_up = threading.Event()
        self._done: asyncio.Future[None] | None = None
        self.told = ""

    async def __call__(self) -> None:
        """Wait until the modem is compiled, or loaded."""
        if self._done is None:
            self._done = asyncio.ensure_future(asyncio.to_thread(self._load))
            # Where nobody waits any more, nobody needs to know.
            self._done.add_done_callback(lambda done: done.cancelled() or done.exception())
        await asyncio.shield(self._done)

    def give_up(self) -> None:
        """Stop behind the kernel that is being compiled: what is done stays so."""
        self._is_given_up.set()

    def _load(self) -> None:
        # This brings numba, which takes its time.
        from sdrlinkd.compiling import compile_modem

        try:
            compile_modem(log.info, watch=self._watch)
        finally:
            self.told = ""

    def _watch(self, done: int, total: int) -> None:
        self.told = f"compiling the modem, once: {done} of {total} kernels"
        if self._is_given_up.is_set():
            raise _GivenUpError
