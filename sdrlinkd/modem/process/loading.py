"""Compiles or loads the modem on a thread, while the event loop does other work."""

import asyncio
import logging
import threading
from collections.abc import Callable

from backends import RefusalError

log = logging.getLogger("sdrlinkd")


class _GivenUpError(Exception):
    """Raised on the loading thread when the modem is no longer needed."""


class Loading:
    """Loads the modem once, however many tasks wait for it; `told` is the progress as text.

    `tell` is called with each new text, on the loading thread.
    """

    def __init__(self, tell: Callable[[str], None] = lambda _: None) -> None:
        self._is_given_up = threading.Event()
        self._done: asyncio.Future[None] | None = None
        self._tell = tell
        self.told = ""
        self._engine = ""

    async def early(self) -> None:
        """Load the compiled modem if there is one, before it is known which engine is wanted."""
        await asyncio.to_thread(_load_what_is_there)

    async def __call__(self, engine: str = "auto") -> None:
        """Wait until the modem is compiled, or loaded. Raises RefusalError if it cannot be."""
        if self._done is None:
            self._done = asyncio.ensure_future(asyncio.to_thread(self._load, engine))
            # Retrieve the exception, so that asyncio does not log it if nobody waits any more.
            self._done.add_done_callback(lambda done: done.cancelled() or done.exception())
        await asyncio.shield(self._done)

    @property
    def engine(self) -> str:
        """What computes the modem, in words; empty if it is not loaded."""
        return self._engine

    def note(self, text: str) -> None:
        """Take the progress of a modem that is loaded in another process; empty: it is loaded."""
        self.told = text
        self._tell(text)

    def give_up(self) -> None:
        """End a compilation after the present kernel; the next start begins anew."""
        self._is_given_up.set()

    def _load(self, engine: str) -> None:
        # These import NumPy, which is slow to load.
        import phy
        from sdrlinkd.compiling import compile_modem

        try:
            self._engine = compile_modem(log.info, watch=self._watch, engine=engine).told
        except phy.EngineError as error:
            raise RefusalError(f"modem.engine: {error}") from None
        finally:
            self.note("")

    def _watch(self, done: int, total: int) -> None:
        self.note(f"compiling the modem, once: {done} of {total} steps")
        if self._is_given_up.is_set():
            raise _GivenUpError


def _load_what_is_there() -> None:
    import phy
    from phy import engine

    if engine.fitting() is not None:
        phy.warm_up()
