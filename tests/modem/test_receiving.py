"""The receiver on its thread, and its position in the stream."""

import asyncio
import threading

import numpy as np
import pytest

import phy
from backends import RxBlock
from sdrlinkd.link import Sensed
from sdrlinkd.modem.testing import MAX_BLOCKS, ReceiverHere, ReceiverThread, SensingReceiver


def make_receiving(senses=False):
    return SensingReceiver(phy.Receiver(), phy.EnergyDetector() if senses else None, 1e6)


def blocks(samples, size):
    for index in range(0, len(samples), size):
        piece = samples[index : index + size]
        yield RxBlock(index, len(piece), piece, "", 0)


def make_air(seed, n):
    """(samples, PDUs): bursts of one PDU, half a thousand samples apart."""
    rng = np.random.default_rng(seed)
    sent = [rng.bytes(40) for _ in range(n)]
    parts = [phy.Transmitter().modulate([pdu], 3) for pdu in sent]
    gap = np.zeros(500, np.complex64)
    return np.concatenate([gap, *(piece for part in parts for piece in (part, gap))]), sent


class Told:
    """Records everything it is told."""

    def __init__(self):
        self.heard, self.ends = [], []

    def __call__(self, pdus, end):
        self.heard += [pdu.data for pdu in pdus]
        self.ends.append(end)


@pytest.mark.parametrize("size", [64, 700])
async def test_every_event_comes_in_order_however_fast_blocks_come(size):
    samples, sent = make_air(1, 12)
    told = Told()
    receiver = ReceiverThread(make_receiving(), 1e6, told, wakes=True)
    for _ in range(3):
        pending = list(blocks(samples, size))
        for block in pending:
            await receiver.put(block)
    await receiver.finish()
    receiver.stop()
    assert told.heard == 3 * sent
    assert len(told.ends) == 3 * len(pending) + 1
    assert receiver.load.realtime_ratio > 0


async def test_few_blocks_wait_for_a_receiver_that_is_slow():
    samples, _ = make_air(1, 12)
    more, held = blocks(samples, 64), threading.Event()
    receiver = ReceiverThread(
        make_receiving(),
        1e6,
        lambda *_: held.wait(),
        wakes=True,
        call=lambda deliver, *to: deliver(*to),
    )
    put, is_full = 0, asyncio.Event()

    async def put_all():
        nonlocal put
        for block in more:
            await receiver.put(block)
            put += 1
            if put == MAX_BLOCKS:
                is_full.set()
            await asyncio.sleep(0)

    putting = asyncio.ensure_future(put_all())
    try:
        async with asyncio.timeout(60):
            await is_full.wait()
        for _ in range(100):
            await asyncio.sleep(0)
        assert put <= MAX_BLOCKS + 1, "one is at the receiver"
    finally:
        held.set()
    await putting
    await receiver.finish()
    assert receiver.load.realtime_ratio > 0


async def test_only_blocks_with_events_wake_the_loop_unless_all_shall():
    samples, sent = make_air(2, 3)
    told = Told()
    receiver = ReceiverThread(make_receiving(), 1e6, told, wakes=False)
    for block in blocks(samples, 100):
        await receiver.put(block)
    await receiver.finish()
    receiver.stop()
    assert told.heard == sent
    assert len(told.ends) <= 2 * len(sent) + 1


async def test_it_stops_with_blocks_waiting():
    receiver = ReceiverThread(make_receiving(), 1e6, lambda *_: None, wakes=False)
    for block in blocks(np.zeros(8 * 4096, np.complex64), 4096):
        await receiver.put(block)
    receiver.stop()
    await asyncio.sleep(0)


@pytest.mark.parametrize("size", [64, 700])
async def test_in_lock_step_all_is_told_before_put_returns(size):
    samples, sent = make_air(3, 4)
    told, receiving = Told(), make_receiving(senses=True)
    receiver = ReceiverHere(receiving, 1e6, told)
    pending = list(blocks(samples, size))
    for n, block in enumerate(pending, start=1):
        await receiver.put(block)
        assert told.ends == [each.index + each.n for each in pending[:n]]
        assert told.ends[-1] / 1e6 - 64e-6 < receiving.sensed.until <= told.ends[-1] / 1e6
    assert told.heard == sent
    await receiver.finish()
    assert receiver.load.realtime_ratio > 0
    receiver.stop()


@pytest.mark.parametrize("is_threaded", [True, False])
async def test_what_the_last_samples_hold_is_told_at_the_end_of_the_stream(is_threaded):
    samples, sent = make_air(5, 2)
    told, receiving = Told(), make_receiving()
    receiver = (
        ReceiverThread(receiving, 1e6, told, wakes=False)
        if is_threaded
        else ReceiverHere(receiving, 1e6, told)
    )
    samples = samples[:-500]
    for block in blocks(samples, 300):
        await receiver.put(block)
    await receiver.finish()
    receiver.stop()
    assert told.heard == sent
    assert told.ends[-1] == len(samples)


async def test_thread_and_lock_step_tell_the_same():
    samples, _ = make_air(4, 4)
    threaded, here = Told(), Told()
    ears = make_receiving(senses=True), make_receiving(senses=True)
    on_thread = ReceiverThread(ears[0], 1e6, threaded, wakes=True)
    in_place = ReceiverHere(ears[1], 1e6, here)
    for block in blocks(samples, 333):
        await on_thread.put(block)
        await in_place.put(block)
    for receiver in (on_thread, in_place):
        await receiver.finish()
        receiver.stop()
    assert (threaded.heard, threaded.ends[:-1]) == (here.heard, here.ends[:-1])
    assert ears[0].sensed == ears[1].sensed != Sensed()
