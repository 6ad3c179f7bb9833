"""Hubs that stop and come back, and radios that cannot keep up."""

import asyncio
import contextlib
import itertools
import threading
import time

import numpy as np
import pytest
import zmq

from backends import (
    BackendError,
    EtherRadio,
    Patience,
    RadioParams,
    TxBurst,
    TxOutcome,
    hub_in,
)
from backends.testing import (
    AIR,
    BEHIND_S,
    CONSTANTS,
    MAX_WAITING,
    HubSockets,
    Presence,
    protocol,
)
from tests.backends.hubs import Listener, ask, serving, until
from tests.backends.radios import BLOCK_S, RATE, TUNING, N, noise, opened, send, take

pytestmark = pytest.mark.usefixtures("at_ease")
FAR = 10**9


def assert_contiguous(blocks):
    for one, other in itertools.pairwise(blocks):
        assert other.index == one.index + one.n
        assert other.host_ns >= one.host_ns


def gaps_in(blocks):
    return [block for block in blocks if block.samples is None]


@contextlib.asynccontextmanager
async def closing(radio):
    """Close the radio at the end."""
    try:
        yield
    finally:
        await radio.close()


async def take_gap(blocks):
    """Take blocks up to and including the next gap."""
    taken = await take(blocks, 1)
    while taken[-1].samples is not None:
        taken += await take(blocks, 1)
    return taken


@pytest.mark.slow
async def test_when_a_hub_comes_back_its_radios_go_on_behind_one_gap(tmp_path, monkeypatch):
    radio = EtherRadio(hub_in(tmp_path), 1, "the radio")
    async with asyncio.timeout(20), closing(radio):
        with serving(tmp_path):
            await radio.open(TUNING)
            blocks = radio.blocks()
            taken = await take(blocks, 20 * N)
        coming = asyncio.ensure_future(take_gap(blocks))
        await until(lambda: radio.counters["hub_outages"] == 1)
        assert "the hub is gone" in radio.detail
        gone_s = time.monotonic()
        asked, is_to_ask = [], Presence.is_to_ask
        monkeypatch.setattr(
            Presence, "is_to_ask", lambda *now: is_to_ask(*now) and not asked.append(now)
        )
        await until(lambda: len(asked) > 5)
        away_s = time.monotonic() - gone_s
        with serving(tmp_path):
            taken += await coming
            taken += await take(blocks, taken[-1].index + taken[-1].n + 20 * N)
            assert "the hub is gone" not in radio.detail
            assert ask(tmp_path).nodes == {1: "the radio"}
        counted = {name: n for name, n in radio.counters.items() if n and name != "air_cpu_ms"}
        assert counted == {"hub_outages": 1}
    assert_contiguous(taken)
    (gap,) = gaps_in(taken)
    assert gap.gap_reason == "the hub was gone"
    # It is as long as the hub was away, so that time went on.
    before = taken[taken.index(gap) - 1]
    apart_s = (taken[-1].host_ns - before.host_ns) * 1e-9
    n = taken[-1].index + taken[-1].n - before.index - before.n
    assert n / RATE == pytest.approx(apart_s, abs=10 * BLOCK_S)
    assert gap.n / RATE >= away_s - 2 * BLOCK_S


@pytest.mark.slow
@pytest.mark.parametrize("params", [RadioParams(), RadioParams(full_duplex=False)])
async def test_bursts_for_a_hub_that_went_away_are_lost_and_those_after_it_leave(
    tmp_path, params, monkeypatch
):
    radio = EtherRadio(hub_in(tmp_path), 1, "the radio")
    async with asyncio.timeout(20), closing(radio):
        with serving(tmp_path, {1: params}):
            await radio.open(TUNING)
            blocks = radio.blocks()
            # One burst is too late, so that hub and radio have something to count.
            late = TxBurst(0, noise(10), latest=0)
            reports, _ = await send(radio, blocks, [late, TxBurst(N, noise(20))])
            assert [each.outcome for each in reports] == [TxOutcome.LATE, TxOutcome.SENT]
            lost = [radio.send(TxBurst(FAR, noise(10)))]
            await take(blocks, 1)
        end = 0

        async def follow():
            nonlocal end
            async for block in blocks:
                end = block.index + block.n

        coming = asyncio.ensure_future(follow())
        await until(lambda: radio.counters["hub_outages"] == 1)
        lost.append(radio.send(TxBurst(0, noise(10))))
        # The second hub stays, however slow the machine is.
        monkeypatch.setattr(*CONSTANTS["presence_quiet_s"], 10.0)
        with serving(tmp_path, {1: params}):
            assert {(await each).outcome for each in lost} == {TxOutcome.LOST}
            assert ask(tmp_path).bursts == 0, "what was sent in vain stays where it is"
            # What is sent before the radio knows of the new hub is lost, too.
            await until(lambda: not radio.trouble)
            begin = end + 400 * N
            report = await radio.send(TxBurst(begin, noise(300), latest=begin))
            assert report == (TxOutcome.SENT, begin, begin + 300)
            assert ask(tmp_path).bursts == 1
        coming.cancel()
        await asyncio.wait([coming])


async def test_a_hub_that_comes_back_may_refuse(tmp_path):
    radio = EtherRadio(hub_in(tmp_path), 1, "the radio")
    async with asyncio.timeout(20), closing(radio):
        with serving(tmp_path):
            await radio.open(TUNING)
            blocks = radio.blocks()
            await take(blocks, N)
            sending = radio.send(TxBurst(FAR, noise(10)))
        with (
            serving(tmp_path, rate_hz=2 * RATE),
            pytest.raises(BackendError, match=r"modem\.rate_hz: got 100000; allowed: 200000"),
        ):
            await take(blocks)
        assert (await sending).outcome is TxOutcome.LOST


async def test_a_hub_that_was_silent_but_knows_its_radios_is_not_joined_again(
    tmp_path, monkeypatch
):
    """The radio's count goes on, and what was handed over meanwhile leaves."""
    with serving(tmp_path):
        async with opened(EtherRadio(hub_in(tmp_path), 1, "the radio")) as radio:
            blocks = radio.blocks()
            taken = await take(blocks, 10 * N)
            take_all, go_on = HubSockets.take, threading.Event()

            def stall(*to_take):
                go_on.wait()
                take_all(*to_take)

            monkeypatch.setattr(HubSockets, "take", stall)
            coming = asyncio.ensure_future(take(blocks, taken[-1].index + 60_000))
            await until(lambda: radio.counters["hub_outages"] == 1)
            sending = radio.send(TxBurst(0, noise(50)))
            go_on.set()
            taken += await coming
            assert (await sending).outcome is TxOutcome.SENT
            assert radio.counters["hub_outages"] == 1
            assert ask(tmp_path).nodes == {1: "the radio"}
    assert_contiguous(taken)


@pytest.mark.slow
async def test_a_radio_that_does_not_read_misses_samples_and_hinders_nobody(tmp_path, monkeypatch):
    monkeypatch.setattr(*CONSTANTS["real_time_max_behind_s"], 0.05)
    with serving(tmp_path):
        listener = Listener(tmp_path)
        async with opened(EtherRadio(hub_in(tmp_path), 1, "")) as radio:
            blocks = radio.blocks()
            taken = await take(blocks, 1)
            began_s = ask(tmp_path).now_s
            # Nobody takes blocks: soon its thread has no room for another one.
            await until(lambda: ask(tmp_path).now_s > began_s + 0.5)
            taken += await take_gap(blocks)
            # From here on there are no more gaps, so the count is of those that were taken.
            monkeypatch.setattr(*CONSTANTS["real_time_max_behind_s"], FAR)
            taken += await take(blocks, taken[-1].index + 20 * N)
            reports, more = await send(radio, blocks, [TxBurst(0, noise(100))])
            gone_s = ask(tmp_path).now_s - began_s
            counters = dict(radio.counters)
        others = listener.stop()
    taken += more
    assert_contiguous(taken)
    assert reports[0].outcome is TxOutcome.SENT
    gaps = gaps_in(taken)
    assert gaps[0].n > 0.05 * RATE
    assert {block.gap_reason for block in gaps} == {"the daemon was too slow"}
    assert counters["overflows"] == len(gaps)
    assert counters["samples_lost"] == sum(block.n for block in gaps)
    # Meanwhile the other radio has gone on.
    assert len(others) >= gone_s * RATE


async def test_a_burst_that_was_slow_begins_late_and_the_next_do_not(tmp_path, monkeypatch):
    """Samples are made later from then on."""
    with serving(tmp_path) as hub:
        async with (
            opened(EtherRadio(hub_in(tmp_path), 2, "")) as other,
            opened(EtherRadio(hub_in(tmp_path), 1, "")) as radio,
        ):
            blocks, reply = radio.blocks(), HubSockets.reply
            taken = await take(blocks, N)
            held = threading.Event()

            def slowly(sockets, identity, message, samples):
                if isinstance(message, protocol.Arriving):
                    held.wait()
                return reply(sockets, identity, message, samples)

            monkeypatch.setattr(HubSockets, "reply", slowly)
            apart_s = hub.medium.time(1, 0) - hub.medium.time(2, 0)
            at = taken[-1].index + 20 * N
            sending = other.send(TxBurst(at + round(apart_s * RATE), noise(300)))
            hearing = asyncio.ensure_future(take(other.blocks(), 10**9))
            # The samples of its beginning are made before it comes.
            taken += await take(blocks, at + 50)
            late_from = taken[-1].index + taken[-1].n
            held.set()
            taken += await take(blocks, at + 20 * N)
            assert (await sending).outcome is TxOutcome.SENT
            hearing.cancel()
            await asyncio.wait([hearing])
            assert radio.counters["bursts_slow"] == 1
            made_s = []
            while len(made_s) < 3 * MAX_WAITING:
                (block,) = await take(blocks, 1)
                made_s.append(1e-9 * (time.monotonic_ns() - block.host_ns))
            assert min(made_s) > BEHIND_S + 50 / RATE
    where = np.flatnonzero(np.abs(np.concatenate([block.samples for block in taken])) > 1e-3)
    assert len(where) > 290, "it is heard as a whole"
    assert where[0] >= late_from


async def test_a_radio_a_little_behind_gets_larger_blocks_and_loses_nothing(tmp_path):
    """Gaps and bursts keep their positions."""
    turnaround = 100
    params = RadioParams(full_duplex=False, turnaround_s=turnaround / RATE)
    begins, mark = (6000, 12_000), TxBurst(9000, noise(300))
    with serving(tmp_path, {1: params}) as hub:
        async with (
            opened(EtherRadio(hub_in(tmp_path), 2, "")) as other,
            opened(EtherRadio(hub_in(tmp_path), 1, "")) as radio,
        ):
            apart_s = hub.medium.time(1, 0) - hub.medium.time(2, 0)
            at = 9000 + round(apart_s * RATE)
            other.send(mark._replace(start=at, latest=at))
            blocks = radio.blocks()
            sends = [radio.send(TxBurst(begin, noise(700), latest=begin)) for begin in begins]
            taken = await take(blocks, 1)
            # The radio reads no more until all of it is long over.
            await until(lambda: ask(tmp_path).now_s - hub.medium.time(1, 0) > 16_000 / RATE)
            taken += await take(blocks, 16_000)
            reports = [await each for each in sends]
            assert radio.counters["samples_lost"] == 0
    assert reports == [(TxOutcome.SENT, begin, begin + 700) for begin in begins]
    assert_contiguous(taken)
    assert max(block.n for block in taken) > 4 * N
    missing = [i for b in gaps_in(taken) for i in range(b.index, b.index + b.n)]
    assert missing == [
        i for begin in begins for i in range(begin - turnaround, begin + 700 + turnaround)
    ]
    line = np.concatenate(
        [np.zeros(block.n) if block.samples is None else block.samples for block in taken]
    )
    where = np.flatnonzero(np.abs(line) > 1e-3)
    assert 9000 <= where[0] < where[-1] < 9300
    assert len(where) > 290


async def test_a_radio_that_waits_for_a_hub_greets_the_next_one_too(tmp_path):
    """The first hub died together with the radio's Hello."""
    radio = EtherRadio(hub_in(tmp_path), 1, "the radio", Patience.THERE)
    async with asyncio.timeout(30), closing(radio):
        opening = asyncio.ensure_future(radio.open(TUNING))
        with zmq.Context() as context, context.socket(zmq.ROUTER) as deaf:
            deaf.bind(f"ipc://{tmp_path / AIR}")
            assert await asyncio.to_thread(deaf.poll, 10_000)
            deaf.recv_multipart()
        with serving(tmp_path):
            await opening
            assert ask(tmp_path).nodes == {1: "the radio"}
