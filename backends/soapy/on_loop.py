"""A call from a thread to the event loop; the thread waits for its end."""

import asyncio
import threading
from collections.abc import Callable

LOOK_S = 0.1


def on_loop(
    loop: asyncio.AbstractEventLoop | None, is_over: threading.Event, action: Callable[[], None]
) -> None:
    """Run `action` on the event loop, and wait until it is done, or `is_over` is set."""
    done = threading.Event()

    def act() -> None:
        action()
        done.set()

    if loop is None or loop.is_closed():
        return
    loop.call_soon_threadsafe(act)
    while not done.wait(LOOK_S) and not is_over.is_set():
        continue
