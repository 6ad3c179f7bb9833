"""Ends this process together with the process that started it, even if that one was killed.

The kernel's parent-death signal is sent when the parent's *thread* ends, and never to a process
that was orphaned before it requested the signal. A pipe has neither problem: its other end stays
open for as long as the parent lives.
"""

import contextlib
import os
import signal
import threading
import time

VARIABLE = "SDRLINKD_ENDS_WITH_STDIN"
STOP_S = 20.0


def end_with_parent() -> None:
    """Stop this process when stdin, a pipe from the parent, ends, if VARIABLE is set."""
    if os.environ.pop(VARIABLE, ""):
        threading.Thread(target=_wait, name="parent", daemon=True).start()


def _wait() -> None:
    with contextlib.suppress(OSError):
        while os.read(0, 64):
            pass
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(STOP_S)
    os.kill(os.getpid(), signal.SIGKILL)
