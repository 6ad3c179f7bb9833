"""Processes of ours, of which none is left behind."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path

from sdrlinkd import parent

STOP_TIMEOUT_S = 20.0


class Process:
    """A Python module that runs by itself once started; its log is shown only when it fails.

    It ends with us, also when we are killed.
    """

    def __init__(self, module: str, arguments: Sequence[str], log_path: Path) -> None:
        self._module = module
        self._arguments = arguments
        self._log_path = log_path
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start it; whoever stops it is told of it before."""
        with self._log_path.open("w") as log_file, _interrupts_later():
            # In a session of its own: Ctrl-C is ours to pass on, in the right order.
            self._process = subprocess.Popen(
                [sys.executable, "-m", self._module, *self._arguments],
                stdin=subprocess.PIPE,
                stdout=log_file,
                stderr=log_file,
                start_new_session=True,
                env={**os.environ, parent.VARIABLE: "1"},
            )

    @property
    def pid(self) -> int:
        """Its number, once it is started."""
        if self._process is None:
            raise RuntimeError("pid before start")
        return self._process.pid

    @property
    def is_running(self) -> bool:
        """Whether it has begun and not ended."""
        return self._process is not None and self._process.poll() is None

    def log(self) -> str:
        """What it has said."""
        return self._log_path.read_text().strip()

    def stop(self) -> None:
        """Ask it to end, and make sure; nothing when it was not started."""
        if self._process is None:
            return
        self._process.terminate()
        try:
            self._process.wait(timeout=STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._process.stdin is not None:
            self._process.stdin.close()


@contextlib.contextmanager
def _interrupts_later() -> Iterator[None]:
    """A Ctrl-C in the moment in which a process runs that nobody knows of yet comes after it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    interrupts: list[int] = []
    handler = signal.signal(signal.SIGINT, lambda number, _: interrupts.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        if interrupts:
            signal.raise_signal(signal.SIGINT)
