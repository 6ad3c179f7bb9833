"""Ending with the process that started this one, also when that was killed.

The kernel's parent-death signal goes out when the starter's *thread* ends, and not at all to who
was orphaned before asking for it. A pipe has neither fault: its other end is open for as long as
the starter lives.
"""

import contextlib
import os
import signal
import threading
import time

VARIABLE = "SDRLINKD_ENDS_WITH_STDIN"
STOP_S = 20.0


def end_with_parent() -> None:
    """Stop when standard input, a pipe of the starter's, ends: where VARIABLE asks for it."""
    if os.environ.pop(VARIABLE, ""):
        threading.Thread(target=_wait, name="parent", daemon=True).start()


def _wait() -> None:
    with contextlib.suppress(OSError):
        while os.read(0, 64):
            pass
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(STOP_S)
    os.kill(os.getpid(), signal.SIGKILL)
