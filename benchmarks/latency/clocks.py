"""Two daemons in real time: their estimates of each other's host clock, and of messages' ages.

Their radios' sample counts start at different times and run at different rates. Both use the same
host clock, so any offset that they estimate is an error.
"""

import struct
import time
from typing import NamedTuple

import numpy as np

from benchmarks.peers.latency.daemons import Air, running
from sdrlinkd.client import ControlClient, Publisher, Subscriber

AIR = Air(rate_hz=1e6, mcs=1, pdu_size=512, share=0.5)
LOAD = 0.3
"""Share of the air that both robots use together."""
SETTLING_S = 5.0
EACH_S = 0.1
CDR = b"\0\1\0\0"
_AT = struct.Struct("<q")


class Found(NamedTuple):
    """Errors of clocks and ages, in s."""

    offsets_s: np.ndarray
    ages_s: np.ndarray
    within: float
    """Share of offsets within their bounds."""


def measure(hz: float, seconds: float, airtime_s: float) -> Found:
    """Measure with CLOCKs at `hz`; `airtime_s` is that of a burst with one message."""
    offsets, ages, good = [], [], 0
    period_s = 2 * airtime_s / LOAD
    with running(AIR._replace(clock_s=1 / hz), [1, 2], ["load"]) as daemons:
        one, two = daemons.folders[1], daemons.folders[2]
        with (
            Publisher(one) as out_1,
            Publisher(two) as out_2,
            Subscriber("/rx_robot_1/load", runtime_dir=two) as heard,
            ControlClient(one) as control_1,
            ControlClient(two) as control_2,
        ):
            began = time.monotonic()
            next_at, look_at = began, began + SETTLING_S
            while (now := time.monotonic()) < began + SETTLING_S + seconds:
                if now >= next_at:
                    filler = bytes(AIR.pdu_size - 64)
                    sent_ns = time.time_ns()
                    load = CDR + _AT.pack(sent_ns) + filler
                    out_1.send("/robot_1/load", load, published_ns=sent_ns)
                    out_2.send("/robot_2/load", CDR + _AT.pack(0) + filler)
                    next_at += period_s
                if now >= look_at:
                    look_at += EACH_S
                    for control in (control_1, control_2):
                        clock = control.ask("peers")[0]["clock"] or {}
                        if clock.get("wall_offset_ms") is not None:
                            offsets.append(1e-3 * clock["wall_offset_ms"])
                            good += abs(offsets[-1]) <= 1e-6 * clock["wall_bound_us"]
                message = heard.receive(max(0.0, min(next_at, look_at) - time.monotonic()))
                if message is not None and message.published_ns and now > began + SETTLING_S:
                    (sent_ns,) = _AT.unpack_from(message.payload, len(CDR))
                    ages.append(1e-9 * (message.published_ns - sent_ns))
    return Found(np.array(offsets), np.array(ages), good / max(1, len(offsets)))
