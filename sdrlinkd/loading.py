"""The modem, compiled or loaded on a thread while the bus takes messages already."""

import logging
import threading

log = logging.getLogger("sdrlinkd")


class _GivenUpError(Exception):
    """Nobody waits for it any more."""


class Loading:
    """Called on a thread; `told` is how far it is, for people."""

    def __init__(self) -> None:
        self._is_given_up = threading.Event()
        self.told = ""

    def __call__(self) -> None:
        """Compile the modem, or load it."""
        # It brings numba, which takes its time.
        from sdrlinkd.compiling import compile_modem

        try:
            compile_modem(log.info, watch=self._watch)
        finally:
            self.told = ""

    def give_up(self) -> None:
        """Stop behind the kernel that is being compiled: what is done stays so."""
        self._is_given_up.set()

    def _watch(self, done: int, total: int) -> None:
        self.told = f"the modem is being compiled, once: {done} of {total} kernels"
        if self._is_given_up.is_set():
            raise _GivenUpError
