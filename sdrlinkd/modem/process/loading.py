"""Compiles or loads the modem on a thread, while the event loop does other work."""

import asyncio
import contextlib
import logging
import sys
import threading
from collections.abc import Callable, Iterator

log = logging.getLogger("sdrlinkd")


class _GivenUpError(Exception):
    """Raised on the loading thread when the modem is no longer needed."""


@contextlib.contextmanager
def _without_scipy() -> Iterator[None]:
    """Keep numba from importing SciPy: it would take a third of a second, only to look for BLAS."""
    if "scipy" in sys.modules:
        yield
        return
    sys.modules["scipy"] = None  # type: ignore[assignment]
    try:
        yield
    finally:
        del sys.modules["scipy"]


class Loading:
    """Loads the modem once, however many tasks wait for it; `told` is the progress as text.

    `tell` is called with each new text, on the loading thread.
    """

    def __init__(self, tell: Callable[[str], None] = lambda _: None) -> None:
        self._is_given_up = threading.Event()
        self._done: asyncio.Future[None] | None = None
        self._tell = tell
        self.told = ""

    async def __call__(self) -> None:
        """Wait until the modem is compiled, or loaded."""
        if self._done is None:
            self._done = asyncio.ensure_future(asyncio.to_thread(self._load))
            # Retrieve the exception, so that asyncio does not log it if nobody waits any more.
            self._done.add_done_callback(lambda done: done.cancelled() or done.exception())
        await asyncio.shield(self._done)

    def note(self, text: str) -> None:
        """Take the progress of a modem that is loaded in another process; empty: it is loaded."""
        self.told = text
        self._tell(text)

    def give_up(self) -> None:
        """Stop after the kernel being compiled; compiled kernels are kept."""
        self._is_given_up.set()

    def _load(self) -> None:
        # This imports numba, which is slow to load.
        from sdrlinkd.compiling import compile_modem

        try:
            with _without_scipy():
                compile_modem(log.info, watch=self._watch)
        finally:
            self.note("")

    def _watch(self, done: int, total: int) -> None:
        self.note(f"compiling the modem, once: {done} of {total} kernels")
        if self._is_given_up.is_set():
            raise _GivenUpError
