"""A radio that hears itself: its clock, its noise, and what a slow reader misses."""

import asyncio
import gc
import itertools
import time
import weakref

import numpy as np
import pytest

from backends import GAP, Channel, JammerParams, LoopbackRadio, TxBurst, TxOutcome
from backends.testing import CONSTANTS, MAX_LATE_BLOCKS, Pace
from phy import FrontEndParams, PathParams
from tests.backends.radios import (
    AIR,
    BLOCK_S,
    RATE,
    N,
    bursts,
    hand_over,
    heard,
    noise,
    opened,
    send,
    stream,
    take,
)

FOREVER_S = 1e6


def noisy(seed=1, noise_dbfs=-20.0, **path):
    return Channel(PathParams(rate_hz=RATE, **path), FrontEndParams(noise_dbfs=noise_dbfs), seed)


@pytest.fixture
def few_waiting(monkeypatch):
    """Let only two blocks wait for the reader, so that it soon falls behind."""
    monkeypatch.setattr(*CONSTANTS["max_waiting"], 2)


async def gap_in(blocks, taken):
    """The next gap; earlier blocks are appended to `taken`."""
    while (block := (await take(blocks, 1))[0]).samples is not None:
        taken.append(block)
    return block


async def test_a_paced_loopback_runs_in_real_time(monkeypatch):
    monkeypatch.setattr(*CONSTANTS["loopback_max_behind_s"], FOREVER_S)
    late_s = []
    async with opened(LoopbackRadio(AIR, BLOCK_S)) as radio:
        began = time.monotonic()
        async for block in radio.blocks():
            stream_s = (block.index + block.n) / RATE
            late_s.append(time.monotonic() - began - stream_s)
            if stream_s >= 0.5:
                break
    assert min(late_s) > -0.002, "samples before their time"
    # A busy machine stalls now and then, but not at every block.
    quarter = len(late_s) // 4
    assert min(late_s[-quarter:]) - min(late_s[:quarter]) < 0.015


async def test_host_time_is_when_the_last_sample_was_there():
    async with opened(LoopbackRadio(AIR, BLOCK_S)) as radio:
        taken = []
        async for block in radio.blocks():
            assert block.host_ns <= time.monotonic_ns() + 1_000_000
            taken.append(block)
            if block.index >= 10 * N:
                break
    first, last = taken[0], taken[-1]
    apart = last.index + last.n - first.index - first.n
    assert last.host_ns - first.host_ns == pytest.approx(apart / RATE * 1e9, abs=10)


@pytest.mark.slow
async def test_an_unpaced_loopback_does_not_wait():
    async with opened(LoopbackRadio(AIR, block_s=1000.0, paced=False)) as radio:
        taken = await take(radio.blocks(), 2 * 1000 * RATE)
    assert [block.n for block in taken] == [1000 * RATE] * 2


@pytest.mark.parametrize("noise_dbfs", [-60, -20, -3])
async def test_the_noise_has_the_power_asked_for(noise_dbfs):
    radio = LoopbackRadio(noisy(noise_dbfs=noise_dbfs), BLOCK_S, paced=False)
    samples = await stream(radio, 100_000)
    power_db = 10 * np.log10(np.mean(np.abs(samples) ** 2))
    assert power_db == pytest.approx(noise_dbfs, abs=0.1)


@pytest.mark.slow
async def test_without_hearing_itself_there_is_only_noise():
    deaf = LoopbackRadio(noisy(), BLOCK_S, paced=False, hear_self=False)
    wanted = bursts(3)
    sent = [weakref.ref(burst.samples) for burst in wanted]
    async with opened(deaf):
        reports, taken = await send(deaf, deaf.blocks(), wanted)
    del wanted
    assert {report.outcome for report in reports} == {TxOutcome.SENT}
    samples = heard(taken)
    quiet = await stream(LoopbackRadio(noisy(), BLOCK_S, paced=False), len(samples))
    assert np.array_equal(samples, quiet)
    gc.collect()
    assert [each() for each in sent] == [None] * len(sent), "what is never heard is not kept"


async def test_a_burst_is_heard_in_its_noise():
    burst = TxBurst(500, noise(3000, scale=0.5))
    radio = LoopbackRadio(noisy(loss_db=6), BLOCK_S, paced=False)
    async with opened(radio):
        (report,), taken = await send(radio, radio.blocks(), [burst])
    samples = heard(taken)[: report.end]
    quiet = await stream(LoopbackRadio(noisy(), BLOCK_S, paced=False), report.end)
    alone = (samples - quiet)[report.start :]
    gain = np.vdot(burst.samples, alone) / np.vdot(burst.samples, burst.samples)
    assert 20 * np.log10(np.abs(gain)) == pytest.approx(-6, abs=0.01)
    assert np.abs(alone - gain * burst.samples).max() < 1e-5


async def test_any_length_of_blocks_gives_the_same_samples():
    streams = []
    for block_s in (BLOCK_S, 0.00137, 1.0):
        radio = LoopbackRadio(noisy(seed=4), block_s, paced=False)
        async with opened(radio):
            _, taken = await send(radio, radio.blocks(), bursts(4))
        streams.append(heard(taken))
    length = min(map(len, streams))
    assert length > 3000
    assert all(np.array_equal(each[:length], streams[0][:length]) for each in streams)


async def test_a_reader_far_behind_finds_a_gap(monkeypatch, few_waiting):
    monkeypatch.setattr(*CONSTANTS["loopback_max_behind_s"], 0.1)
    async with opened(LoopbackRadio(AIR, BLOCK_S)) as radio:
        sends = await hand_over(radio, [TxBurst(25_000, noise(50))])
        blocks = radio.blocks()
        taken = await take(blocks, N)
        await asyncio.sleep(0.35)
        taken.append(await gap_in(blocks, taken))
        # From here on there are no more blocks, so the count is of those that were taken.
        monkeypatch.setattr(*CONSTANTS["loopback_max_behind_s"], FOREVER_S)
        again = TxBurst(taken[-1].index + taken[-1].n + 10_000, noise(200))
        (report,), more = await send(radio, blocks, [again])
        taken += more
        missed = await sends[0]
        counters = dict(radio.counters)
    for one, other in itertools.pairwise(taken):
        assert other.index == one.index + one.n
        assert other.host_ns >= one.host_ns
    gaps = [block for block in taken if block.samples is None]
    assert all(block.gap_reason == "the reader was too slow" for block in gaps)
    assert max(block.n for block in gaps) > 0.1 * RATE
    assert counters["overflows"] == len(gaps)
    assert counters["samples_lost"] == sum(block.n for block in gaps)
    # A burst leaves whether or not it is heard; after the gap everything is heard again.
    assert (missed.outcome, missed.start) == (TxOutcome.SENT, 25_000)
    line = np.concatenate(
        [np.zeros(block.n) if block.samples is None else block.samples for block in taken]
    )
    assert np.count_nonzero(line[report.start : report.end]) == 200
    assert not line[: report.start].any()


async def test_a_reader_a_little_behind_gets_larger_blocks_and_loses_nothing(
    monkeypatch, few_waiting
):
    monkeypatch.setattr(*CONSTANTS["loopback_max_behind_s"], FOREVER_S)
    burst = TxBurst(5000, noise(20_000))
    async with opened(LoopbackRadio(AIR, BLOCK_S)) as radio:
        (sending,) = await hand_over(radio, [burst])
        blocks = radio.blocks()
        taken = await take(blocks, N)
        await asyncio.sleep(0.15)
        taken += await take(blocks, 30_000)
        report = await sending
        told = radio.counters
        assert (told["overflows"], told["samples_lost"], told["late"]) == (0, 0, 0)
    assert max(block.n for block in taken) == (1 + MAX_LATE_BLOCKS) * N
    assert len(taken) < 30_000 / N
    got = heard(taken)[report.start : report.end]
    assert report.start == burst.start
    assert np.allclose(np.abs(got), np.abs(burst.samples), atol=1e-6)


async def test_a_burst_for_a_time_that_went_by_leaves_behind_the_gap(monkeypatch, few_waiting):
    monkeypatch.setattr(*CONSTANTS["loopback_max_behind_s"], 0.02)
    async with opened(LoopbackRadio(AIR, BLOCK_S)) as radio:
        blocks = radio.blocks()
        await take(blocks, N)
        await asyncio.sleep(0.1)
        gap = await gap_in(blocks, [])
        (report,), _ = await send(radio, blocks, [TxBurst(gap.index, noise(100))])
    assert report.outcome is TxOutcome.SENT
    assert report.start >= gap.index + gap.n


async def test_a_block_ends_where_a_burst_has_arrived(monkeypatch):
    """Nothing is gained by waiting for the rest of the block."""
    monkeypatch.setattr(Pace, "wait_for", lambda *_: 0)
    async with opened(LoopbackRadio(AIR, BLOCK_S)) as radio:
        _, taken = await send(radio, radio.blocks(), [TxBurst(5000, noise(730))])
    end = 5730 + GAP
    short = {block.index: block.n for block in taken if block.n != N}
    assert short == {end // N * N: end % N}


async def test_a_jammer_comes_and_goes():
    tone = JammerParams(over_noise_db=30.0, offset_hz=25e3, times=[[0.02, 0.04]])
    channel = Channel(PathParams(rate_hz=RATE), FrontEndParams(noise_dbfs=-50.0), 1, [tone])
    x = await stream(LoopbackRadio(channel, BLOCK_S, paced=False), 30 * N)
    levels = 10 * np.log10(np.mean(np.abs(x.reshape(30, N)) ** 2, axis=1))
    is_jammed = [10 <= number < 20 for number in range(30)]
    assert levels.tolist() == [pytest.approx(-20 if each else -50, abs=1.5) for each in is_jammed]
    assert np.argmax(np.abs(np.fft.fft(x[12 * N : 13 * N]))) == N // 4
