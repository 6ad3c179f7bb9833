"""Ends a test that hangs or that computes without end; a busy machine alone ends none."""

import faulthandler
import os
import signal
import threading
from dataclasses import dataclass

# Not by `time.monotonic`, which tests replace.
from time import monotonic

import pytest

from tests.cost import spent_s

LOOK_S = 1.0
IDLE = 0.002
"""Share of a core below which a test waits for something that does not come."""
LAST_WORDS_S = 30.0
"""How long a test may take to fail once it was told to, before its process ends."""


@dataclass(frozen=True)
class Limits:
    """Of one test: processor time, time without any, and time by the clock, all in s."""

    cpu_s: float
    idle_s: float
    wall_s: float


class Watchdog(threading.Thread):
    """Looks at the test that runs, once a second."""

    def __init__(self) -> None:
        super().__init__(name="watchdog", daemon=True)
        self._watched: tuple[str, Limits] | None = None
        self._changed = threading.Condition()
        self._reason = ""
        # While a test runs, its standard error goes elsewhere.
        self._stderr = os.fdopen(os.dup(2), "w")
        signal.signal(signal.SIGALRM, self._fail)

    def watch(self, test: str, limits: Limits) -> None:
        """Watch this test from now on."""
        with self._changed:
            self._watched, self._reason = (test, limits), ""
            self._changed.notify()

    def rest(self) -> None:
        """Watch nothing; returns once no failure is on its way any more."""
        with self._changed:
            self._watched = None
            self._changed.notify()

    def run(self) -> None:
        """Until the process ends."""
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._watched is not None)
                watched = self._watched
            if watched is not None:
                self._follow(watched)

    def _follow(self, watched: tuple[str, Limits]) -> None:
        test, limits = watched
        begin, cpu_begin = monotonic(), spent_s()
        busy, cpu_busy = begin, cpu_begin
        while not self._reason:
            if self._moved_on(watched, LOOK_S):
                return
            now, cpu = monotonic(), spent_s()
            if cpu - cpu_busy > IDLE * limits.idle_s:
                busy, cpu_busy = now, cpu
            used = f"{now - begin:.0f} s by the clock, {cpu - cpu_begin:.0f} s of the processor"
            with self._changed:
                if self._watched is not watched:
                    return
                if cpu - cpu_begin > limits.cpu_s:
                    self._reason = f"computes for too long: {used}"
                elif now - busy > limits.idle_s:
                    self._reason = f"hangs: idle for {now - busy:.0f} s, after {used}"
                elif now - begin > limits.wall_s:
                    self._reason = f"takes too long: {used}"
                if self._reason:
                    signal.pthread_kill(threading.main_thread().ident, signal.SIGALRM)
        if not self._moved_on(watched, LAST_WORDS_S):
            words = f"\n{test} {self._reason}, and cannot be interrupted"
            print(words, file=self._stderr, flush=True)
            faulthandler.dump_traceback(self._stderr)
            os._exit(1)

    def _moved_on(self, watched: tuple[str, Limits], within_s: float) -> bool:
        with self._changed:
            return self._changed.wait_for(lambda: self._watched is not watched, within_s)

    def _fail(self, *_: object) -> None:
        if self._watched is not None:
            pytest.fail(f"it {self._reason}")
