"""The receiver's CPU time for one burst. Runs in a process of its own, with any checkout's `phy`.

Arguments: the number of bursts, and the seed. Prints the median time in µs as JSON, by name.
"""

import gc
import json
import sys
import time

import numpy as np
from numpy.typing import NDArray

import phy

MCS, SIZE = 1, 64
SNR_DB = 15.0
GAP = 100
"""Samples of noise before each burst."""
WARM_UP = 50
ASLEEP_S = 0.02


def main() -> None:
    """Measure the receiver that is never idle, then the one that sleeps before each burst."""
    n, seed = int(sys.argv[1]), int(sys.argv[2])
    gc.disable()
    found = {"hot": _median_us(n, seed, 0.0), "asleep": _median_us(n, seed, ASLEEP_S)}
    sys.stdout.write(json.dumps(found))


def _median_us(n: int, seed: int, asleep_s: float) -> float:
    bursts, receiver, took_us = _bursts(n + WARM_UP, seed), phy.Receiver(), []
    for i, burst in enumerate(bursts):
        if asleep_s and i >= WARM_UP:
            time.sleep(asleep_s)
        began_ns = time.thread_time_ns()
        receiver.push(burst)
        took_us.append(1e-3 * (time.thread_time_ns() - began_ns))
    # The last burst may end with the next block of samples.
    if receiver.counters["pdus_good"] < 0.99 * len(bursts) - 1:
        raise RuntimeError(f"PDUs were lost: {dict(receiver.counters)}")
    return float(np.median(took_us[WARM_UP:]))


def _bursts(n: int, seed: int) -> NDArray[np.complex64]:
    """Bursts `[n, samples]` of one PDU each, every one after a gap."""
    rng, transmitter = np.random.default_rng(seed), phy.Transmitter()
    front_end = phy.FrontEnd(phy.FrontEndParams(noise_dbfs=-SNR_DB), rng)
    gap, parts = np.zeros(GAP, np.complex64), list[NDArray[np.complex64]]()
    for _ in range(n):
        parts += [gap, transmitter.modulate([rng.bytes(SIZE)], MCS)]
    return front_end.receive(np.concatenate(parts)).reshape(n, -1)
