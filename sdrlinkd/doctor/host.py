"""Measures how late this machine wakes threads and hands over to the event loop.

With a real radio, this adds to the latency of messages.
"""

import asyncio
import threading
import time
from typing import NamedTuple

import numpy as np

from sdrlinkd.doctor.finding import Finding, good, good_if

PERIOD_S = 0.001
"""Typical interval in s between a radio's blocks."""


class HostTerm(NamedTuple):
    """Delays of this machine in s: the 99th percentiles of `n` trials."""

    wakes_s: float
    """From a thread's planned wake-up until it runs."""
    hands_over_s: float
    """From then until the event loop runs its callback."""
    n: int

    @property
    def host_s(self) -> float:
        """Latency in s that this machine adds to a message: the sum of both delays."""
        return self.wakes_s + self.hands_over_s


async def measure_host(n: int) -> HostTerm:
    """Measure how late a thread like a radio's wakes and hands over; takes `n` ms."""
    loop = asyncio.get_running_loop()
    wakes, arrives = np.zeros(n), np.zeros(n)
    done = asyncio.Event()

    def arrived(i: int, woke: float) -> None:
        arrives[i] = time.monotonic() - woke
        if i == n - 1:
            done.set()

    def wake() -> None:
        due = time.monotonic()
        for i in range(n):
            # A stall counts as one late wake-up, not as one for every missed period.
            due = max(due + PERIOD_S, time.monotonic())
            time.sleep(max(0.0, due - time.monotonic()))
            woke = time.monotonic()
            wakes[i] = woke - due
            loop.call_soon_threadsafe(arrived, i, woke)

    thread = threading.Thread(target=wake, daemon=True)
    thread.start()
    await done.wait()
    thread.join()
    wakes_s, hands_over_s = (float(np.percentile(each, 99)) for each in (wakes, arrives))
    return HostTerm(wakes_s, hands_over_s, n)


def check_host(found: HostTerm, lead_s: float | None) -> Finding:
    """The finding on whether this machine is fast enough for its radio.

    `lead_s` is the time by which bursts are handed to the radio early; None without a real radio.
    """
    told = (
        f"wakes {1e3 * found.wakes_s:.2f} ms late and delivers in "
        f"{1e3 * found.hands_over_s:.2f} ms (p99 of {found.n}); "
        f"for plan: --host {1e3 * found.host_s:.1f}ms"
    )
    if lead_s is None:
        return good("host's lateness", told)
    return good_if(
        found.host_s < lead_s, "host's lateness", told,
        f"bursts will be late: end other programs, or raise soapy.lead_s = {lead_s:g}",
    )  # fmt: skip
