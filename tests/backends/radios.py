"""Helpers to run a radio, and to read and write recordings."""

import asyncio
from contextlib import asynccontextmanager

import numpy as np

from backends import (
    Channel,
    RecordingReader,
    RecordingWriter,
    Tuning,
    TxBurst,
    describe,
)
from phy import PathParams

RATE = 100_000.0
BLOCK_S = 0.002
N = 200
"""Samples of an ordinary block."""
TUNING = Tuning(RATE, 868e6)
AIR = Channel(PathParams(rate_hz=RATE), seed=5)
"""An air that changes only the carrier's phase."""
SEED = 20


def noise(n, seed=SEED, scale=0.2):
    """White noise `[n]`, well below full scale."""
    parts = np.random.default_rng(seed).standard_normal(2 * n, np.float32)
    return parts.view(np.complex64) * np.float32(scale)


PLAYED = noise(40_017)
"""What a radio plays from a recording; not a whole number of blocks."""


def record(path, samples, type_name="cf32_le", rate_hz=RATE):
    """Write a recording that begins with `samples`; returns how many values were clipped."""
    writer = RecordingWriter(path, type_name, rate_hz, TUNING.frequency_hz)
    writer.write(0, samples)
    writer.close()
    return writer.clipped


def read(path, type_name=""):
    """All samples of a recording."""
    info = describe(path, type_name)
    reader = RecordingReader(info)
    samples = reader.read(0, info.n_samples)
    reader.close()
    return samples


def heard(blocks):
    """The samples of all blocks that are not gaps."""
    return np.concatenate([np.zeros(0, np.complex64), *(block.samples for block in blocks)])


def bursts(seed, n=8):
    """Bursts in any order, many of which would overlap."""
    rng = np.random.default_rng(seed)
    return [
        TxBurst(int(rng.integers(6000)), noise(int(rng.integers(1, 900)), seed + i))
        for i in range(n)
    ]


@asynccontextmanager
async def opened(radio, tuning=TUNING):
    """Open the radio, and close it at the end."""
    try:
        await radio.open(tuning)
        yield radio
    finally:
        await radio.close()


async def turn():
    """Let the event loop run everything that is due."""
    for _ in range(3):
        await asyncio.sleep(0)


async def hand_over(radio, wanted):
    """Start a task for each burst to send, in order."""
    sends = [asyncio.ensure_future(radio.send(burst)) for burst in wanted]
    await turn()
    return sends


async def take(blocks, until=np.inf):
    """Take blocks up to the one that contains the sample before `until`."""
    taken = []
    async for block in blocks:
        taken.append(block)
        await turn()
        if block.index + block.n >= until:
            break
    return taken


async def send(radio, blocks, wanted):
    """Send bursts; returns (reports, blocks taken until the last of them)."""
    sends = await hand_over(radio, wanted)
    taken = []
    while not all(each.done() for each in sends):
        more = await take(blocks, 1)
        await turn()
        assert more or all(each.done() for each in sends), "the stream ended without an answer"
        taken += more
    return [await each for each in sends], taken


async def stream(radio, until=None):
    """Everything a radio hears up to `until`, or to its end."""
    async with opened(radio):
        return heard(await take(radio.blocks(), until or np.inf))[:until]
