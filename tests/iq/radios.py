"""A radio that delivers given blocks, and stores what it is given to send."""

import asyncio
import time

import numpy as np

import phy
from backends import BackendError, Capabilities, RxBlock, TxOutcome, TxReport
from tests.iq.recordings import RATE_HZ

FREQUENCY_HZ = 2.45e9


def pieces(samples, size, first=0):
    """Blocks of `size` samples."""
    for at in range(0, len(samples), size):
        piece = samples[at : at + size]
        yield RxBlock(first + at, len(piece), piece, "", time.monotonic_ns())


def gap(index, n, reason="the radio lost samples"):
    """A block in which nothing was heard."""
    return RxBlock(index, n, None, reason, time.monotonic_ns())


def air(starts, n, network=0, pdu=b"\x5a" * 64, mcs=1):
    """(samples, length of a burst): bursts of one PDU at -12 dBFS that begin at `starts`."""
    rng = np.random.default_rng(7)
    burst = phy.Transmitter(network).modulate([pdu], mcs) * np.float32(0.25)
    samples = (rng.standard_normal(2 * n, np.float32) * np.float32(0.002)).view(np.complex64)
    for start in starts:
        samples[start : start + len(burst)] += burst
    return samples, len(burst)


class BlockRadio:
    """Delivers `blocks` in order, in one piece of memory; then silence, or it fails."""

    def __init__(self, blocks, fails=None, ends=True, **can):
        self._blocks = blocks
        self._fails = fails
        self._ends = ends
        self._memory = np.zeros(1 << 20, np.complex64)
        given = {"receives": True, "transmits": False, "paced": True} | can
        self.capabilities = Capabilities(full_duplex=True, timestamps=True, **given)
        self.counters = {}
        self.detail = "made by hand"
        self.is_open = False
        self.end = 0
        self.refuses = ""
        self.sent = []
        self.outcome = TxOutcome.SENT

    async def open(self, tuning):
        if self.refuses:
            raise BackendError(self.refuses)
        assert (tuning.rate_hz, tuning.frequency_hz) == (RATE_HZ, FREQUENCY_HZ)
        self.is_open = True

    async def blocks(self, hear=None):
        for block in self._blocks:
            self.end = block.index + block.n
            if block.samples is not None:
                self._memory[: block.n] = block.samples
                block = RxBlock(block.index, block.n, self._memory[: block.n], "", block.host_ns)
            if hear is None:
                yield block
            else:
                await asyncio.to_thread(hear, block)
        if self._fails:
            raise BackendError(self._fails)
        if not self._ends:
            await asyncio.Event().wait()

    async def send(self, burst):
        self.sent.append(burst)
        await asyncio.sleep(0)
        return TxReport(self.outcome, burst.start, burst.start + len(burst.samples))

    async def close(self):
        self.is_open = False
