"""Streams of bursts, and the pieces in which a receiver gets them."""

from itertools import cycle

import numpy as np
from hypothesis import strategies as st

from phy import Transmitter
from phy.testing import preamble
from tests.phy.signals import noise, payloads, silence, turned


def make_stream(seed):
    """(samples, position of a gap, its length, PDUs of the undamaged bursts).

    The stream has own and foreign bursts of any MCS with their own frequency offsets and levels,
    close together or not, false starts, non-finite samples, DC and noise.
    """
    rng = np.random.default_rng(seed)
    parts, sent = [silence(int(rng.integers(0, 1500)))], []
    for _ in range(int(rng.integers(2, 6))):
        kind = rng.choice(["own", "own", "foreign", "false start", "cut short"])
        pdus = payloads(rng, int(rng.integers(1, 9)), int(rng.integers(1, 60)))
        network = int(kind == "foreign")
        burst = Transmitter(network).modulate(pdus, int(rng.integers(0, 7)))
        if kind == "own":
            sent += pdus
        if kind == "false start":
            burst = preamble.preamble()[: int(rng.integers(100, 353))]
        if kind == "cut short":
            burst = burst[: int(rng.integers(353, len(burst)))]
        strength = rng.uniform(0.5, 2)
        pause = 4000 if kind == "cut short" else int(rng.choice([0, 3, 600]))
        parts += [strength * turned(burst, rng.uniform(-0.015, 0.015), rng.random())]
        parts += [silence(pause)]
    x = np.concatenate(parts)
    x = x + noise(rng, len(x), 0.002) + np.complex64(0.05 * rng.standard_normal())
    gap_at = int(rng.integers(0, len(x)))
    if rng.random() < 0.3:
        x[rng.integers(0, len(x), 5)] = np.nan
    return x, gap_at, int(rng.integers(0, 5000)), sent


def push_all(receiver, x, sizes):
    """Events of `x` in chunks of `sizes`, repeated."""
    events, at, size = [], 0, cycle(sizes)
    while at < len(x):
        n = next(size)
        events += receiver.push(x[at : at + n])
        at += n
    return events


chunk_sizes = st.lists(
    st.one_of(
        st.integers(1, 5000),
        st.sampled_from([1, 2, 15, 16, 63, 64, 79, 80, 81, 191, 192, 511, 512, 513, 32768]),
    ),
    min_size=1,
    max_size=12,
)
