"""The receiver on its thread."""

import asyncio

import numpy as np
import pytest

import phy
from backends import RxBlock
from sdrlinkd.modem.rx_thread import MAX_BLOCKS, ReceiverThread


def blocks(samples, size):
    for index in range(0, len(samples), size):
        piece = samples[index : index + size]
        yield RxBlock(index, len(piece), piece, "", 0)


@pytest.mark.parametrize("size", [64, 700])
async def test_every_event_comes_in_order_however_fast_blocks_come(size):
    rng = np.random.default_rng(1)
    sent = [rng.bytes(40) for _ in range(12)]
    parts = [phy.Transmitter().modulate([pdu], 3) for pdu in sent]
    gap = np.zeros(500, np.complex64)
    samples = np.concatenate([gap, *(piece for part in parts for piece in (part, gap))])
    heard, ends = [], []

    def deliver(events, end):
        heard.extend(event.data for event in events if isinstance(event, phy.PduHeard))
        ends.append(end)

    receiver = ReceiverThread(phy.Receiver(), 1e6, deliver, every_block=True)
    for _ in range(3):
        pending = list(blocks(samples, size))
        for block in pending:
            await receiver.put(block)
            assert receiver._blocks.qsize() <= MAX_BLOCKS
    await receiver.finish()
    receiver.stop()
    assert heard == 3 * sent
    assert len(ends) == 3 * len(pending) + 1
    assert receiver.load.realtime_ratio > 0


async def test_it_stops_with_blocks_waiting():
    receiver = ReceiverThread(phy.Receiver(), 1e6, lambda *_: None, every_block=False)
    for block in blocks(np.zeros(8 * 4096, np.complex64), 4096):
        await receiver.put(block)
    receiver.stop()
    await asyncio.sleep(0)
