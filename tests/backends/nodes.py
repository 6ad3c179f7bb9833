"""Nodes on an air inside this process: what they do after each block, and what they hear."""

import asyncio
import itertools

import numpy as np

from backends import LocalEther, Tuning, TxBurst, World
from backends.testing import NOISE_DBFS
from tests.backends.airs import CENTRE_HZ, RATE, SEED, air

BLOCK_S = 0.001
N = 1000
TUNING = Tuning(RATE, CENTRE_HZ)
TIMEOUT_S = 10


def ether_of(radios, seed=SEED, links=(), **params):
    """An air with these radios."""
    shared = air(block_s=BLOCK_S, **params)
    return LocalEther(shared, radios, World(shared, {}, links), seed)


async def drive(radio, taken, react):
    """Run a node: take blocks, and call `react` after each."""
    async for block in radio.blocks():
        taken.append(block)
        if react is not None:
            await react(block)


async def run(ether, until_s, reacts=None):
    """Blocks of each radio, by node; `reacts`: functions to call after each block."""
    taken = {node: [] for node in ether.radios}
    radios = list(ether.radios.values())
    async with asyncio.timeout(TIMEOUT_S), asyncio.TaskGroup() as tasks:
        for node, radio in ether.radios.items():
            await radio.open(TUNING)
            tasks.create_task(drive(radio, taken[node], (reacts or {}).get(node)))
        await ether.run(until_s)
        for radio in radios:
            await radio.close()
    return taken


def sending(radio, wanted, reports):
    """Hand over bursts, each (when, burst), after the first block that ends at `when` or later."""
    waiting = list(wanted)

    async def react(block):
        while waiting and block.index + block.n >= waiting[0][0]:
            reports.append(radio.send(waiting.pop(0)[1]))

    return react


def line_of(blocks):
    """All samples, with zeros for gaps."""
    parts = [
        np.zeros(block.n, np.complex64) if block.samples is None else block.samples
        for block in blocks
    ]
    return np.concatenate(parts)


def above_noise(x):
    """Positions of all samples above the noise."""
    return np.flatnonzero(np.abs(x) > 6 * 10 ** (NOISE_DBFS / 20)).tolist()


def tone(start, n, exact=False):
    return TxBurst(start, np.full(n, 0.5, np.complex64), start if exact else None)


def assert_contiguous(blocks):
    assert blocks[0].index == 0
    for one, other in itertools.pairwise(blocks):
        assert other.index == one.index + one.n
    assert all((block.samples is None) == (block.gap_reason == "sending") for block in blocks)
