"""Plays a recording at its original speed or another."""

import math
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping

from sdrlinkd.adapters.bags import BagMessage


def paced(
    messages: Iterable[BagMessage],
    rate: float,
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
    *,
    max_gap_s: float = math.inf,
    shortened: Callable[[float], None] = lambda _: None,
) -> Iterator[BagMessage]:
    """Yields each message at its time, `rate` times as fast as recorded; infinity: at once.

    Waits end at absolute times, so a late message does not delay those after it. A pause of more
    than `max_gap_s` in the recording is played as one of that length, and `shortened` gets its own.
    """
    start = clock()
    first_ns = last_ns = None
    left_out_s = 0.0
    for message in messages:
        if first_ns is None or last_ns is None:
            first_ns = last_ns = message.time_ns
        pause_s = (message.time_ns - last_ns) * 1e-9
        last_ns = max(last_ns, message.time_ns)
        if pause_s > max_gap_s:
            left_out_s += pause_s - max_gap_s
            shortened(pause_s)
        due = start + ((message.time_ns - first_ns) * 1e-9 - left_out_s) / rate
        wait_s = due - clock()
        if wait_s > 0:
            sleep(wait_s)
        yield message


def from_second(
    messages: Iterable[BagMessage], start_s: float, latched: Mapping[str, int] = {}
) -> Iterator[BagMessage]:
    """The messages of a recording without those of its first `start_s`.

    Of each topic in `latched`, so many of the last messages before are played at the beginning.
    """
    first_ns: int | None = None
    kept = {name: deque[BagMessage](maxlen=n) for name, n in latched.items()}
    for message in messages:
        if first_ns is None:
            first_ns = message.time_ns
        if (message.time_ns - first_ns) * 1e-9 >= start_s:
            earlier = [
                each._replace(time_ns=message.time_ns) for one in kept.values() for each in one
            ]
            kept.clear()
            yield from earlier
            yield message
        elif message.topic in kept:
            kept[message.topic].append(message)


def first_seconds(messages: Iterable[BagMessage], duration_s: float) -> Iterator[BagMessage]:
    """The messages of the first `duration_s` of a recording."""
    first_ns: int | None = None
    for message in messages:
        if first_ns is None:
            first_ns = message.time_ns
        if (message.time_ns - first_ns) * 1e-9 >= duration_s:
            return
        yield message
