"""How late this machine wakes a thread, and hands over from one thread to another.

A real radio's messages are later by this than the air alone makes them.
"""

import asyncio
import threading
import time
from typing import NamedTuple

import numpy as np

from sdrlinkd.doctor.finding import Finding, good, good_if

PERIOD_S = 0.001
"""A radio's blocks come so often."""


class HostTerm(NamedTuple):
    """How late this machine is, in s, at the 99th percentile of `n` trials."""

    wakes_s: float
    """From the moment a thread wants to wake to when it does."""
    hands_over_s: float
    """From when it wakes to the event loop."""
    n: int

    @property
    def host_s(self) -> float:
        """What this machine adds to a message's latency in s: the worst case of both."""
        return self.wakes_s + self.hands_over_s


async def measure_host(n: int) -> HostTerm:
    """How late a radio's thread wakes and hands a block to the event loop; takes `n` ms."""
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
            # A machine that stands still is late once for it, not for all that was missed.
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
    """Whether this machine is in time for its radio.

    `lead_s`: how long ahead bursts are handed over to the radio; None without a real one.
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
