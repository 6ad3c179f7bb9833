"""Plays a recording at its original speed or another."""

import time
from collections.abc import Callable, Iterable, Iterator

from sdrlinkd.adapters.bags import BagMessage


def paced(
    messages: Iterable[BagMessage],
    rate: float,
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> Iterator[BagMessage]:
    """Yields each message at its time, `rate` times as fast as recorded; infinity: at once.

    Waits end at absolute times, so a late message does not delay those after it.
    """
    start = clock()
    first_ns: int | None = None
    for message in messages:
        if first_ns is None:
            first_ns = message.time_ns
        due = start + (message.time_ns - first_ns) * 1e-9 / rate
        wait_s = due - clock()
        if wait_s > 0:
            sleep(wait_s)
        yield message


def from_second(messages: Iterable[BagMessage], start_s: float) -> Iterator[BagMessage]:
    """The messages of a recording without those of its first `start_s`."""
    first_ns: int | None = None
    for message in messages:
        if first_ns is None:
            first_ns = message.time_ns
        if (message.time_ns - first_ns) * 1e-9 >= start_s:
            yield message


def first_seconds(messages: Iterable[BagMessage], duration_s: float) -> Iterator[BagMessage]:
    """The messages of the first `duration_s` of a recording."""
    first_ns: int | None = None
    for message in messages:
        if first_ns is None:
            first_ns = message.time_ns
        if (message.time_ns - first_ns) * 1e-9 >= duration_s:
            return
        yield message
