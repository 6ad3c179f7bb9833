"""A hub in lock-step: no node advances until every node has finished, and results repeat."""

import asyncio
import contextlib
import itertools
import threading
from random import Random

import numpy as np
import pytest

from backends import BackendError, EtherRadio, HubWatch, RadioParams, TxBurst, TxOutcome, hub_in
from backends.testing import CONSTANTS, protocol
from tests.backends.hubs import RawRadio, ask, serving, until
from tests.backends.radios import BLOCK_S, N, noise, opened, send, take, turn

pytestmark = pytest.mark.usefixtures("at_ease")
THREE = dict.fromkeys((1, 2, 3), RadioParams())


def lockstep(folder, radios, **more):
    return serving(folder, radios, paced=False, **more)


async def drive(folder, node, until, react):
    """Run a robot on its own thread's loop: all blocks up to the index `until`."""
    taken = []
    async with opened(EtherRadio(hub_in(folder), node, f"robot {node}")) as radio:
        async for block in radio.blocks():
            taken.append(block)
            await react(node, radio, block)
            if block.index + block.n >= until:
                break
    return taken


def in_threads(folder, nodes, until, react):
    """What each node hears, each on its own thread; `react`: what it does after each block."""
    heard = {}

    def work(node):
        heard[node] = asyncio.run(drive(folder, node, until, react))

    threads = [threading.Thread(target=work, args=(node,), daemon=True) for node in nodes]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)
        assert not thread.is_alive()
    return heard


def hear_a_run(folder, seed, dawdling):
    """What three nodes hear when they send at random; `dawdling` seeds random delays."""
    radios = {
        1: RadioParams(),
        2: RadioParams(full_duplex=False, turnaround_s=0.0005, clock_ppm=15),
        3: RadioParams(
            full_duplex=False, turnaround_s=0.001, timestamps=False, index_error_s=0.0003
        ),
    }
    chances, idle = {node: Random(node) for node in radios}, Random(dawdling)
    reports = {node: [] for node in radios}

    async def react(node, radio, block):
        chance = chances[node]
        end = block.index + block.n
        for _ in range(chance.choice([0, 0, 0, 1, 2])):
            burst = TxBurst(end + chance.randrange(3 * N), noise(chance.randrange(1, 500), end))
            await asyncio.sleep(idle.choice([0, 0.002]))
            reports[node].append(
                radio.send(burst._replace(latest=burst.start if chance.random() < 0.3 else None))
            )
        await asyncio.sleep(idle.choice([0, 0, 0.001]))

    with lockstep(folder, radios, seed=seed, profile="rayleigh"):
        heard = in_threads(folder, radios, 60 * N, react)
    settled = {
        node: [each.result() for each in told if each.done()] for node, told in reports.items()
    }
    return heard, settled


@pytest.mark.slow
def test_one_seed_is_one_run_however_threads_are_timed(tmp_path):
    (one, reports), (same, again), (other, _) = (
        hear_a_run(tmp_path / f"{i}", *seeds) for i, seeds in enumerate([(5, 1), (5, 2), (6, 1)])
    )
    for node, blocks in one.items():
        assert [(b.index, b.n, b.gap_reason) for b in blocks] == [
            (b.index, b.n, b.gap_reason) for b in same[node]
        ]
        for block, twin in zip(blocks, same[node], strict=True):
            if block.samples is not None:
                assert block.samples.tobytes() == twin.samples.tobytes()
        first, another = (each[0].samples[:100] for each in (blocks, other[node]))
        assert not np.allclose(first, another)
    assert reports == again
    outcomes = [report.outcome for each in reports.values() for report in each]
    assert outcomes.count(TxOutcome.SENT) > 15
    assert outcomes.count(TxOutcome.LATE) > 2


async def test_an_air_begins_when_all_are_there_and_goes_on_when_all_have_done(tmp_path):
    with lockstep(tmp_path, dict.fromkeys((1, 2), RadioParams())):
        async with opened(EtherRadio(hub_in(tmp_path), 1, "")) as one:
            ahead = one.blocks()
            coming = asyncio.ensure_future(anext(ahead))
            # Nothing shows that a hub is blocked; without a reason it would go on within this time.
            await asyncio.sleep(0.05)
            assert ask(tmp_path).now_s == 0
            async with opened(EtherRadio(hub_in(tmp_path), 2, "")) as other:
                behind = other.blocks()
                for step in range(4):
                    for block in (await anext(behind), await coming):
                        assert (block.index, block.n) == (step * N, N)
                    coming = asyncio.ensure_future(anext(ahead))
                    for _ in range(10):
                        await turn()
                    assert ask(tmp_path).now_s == pytest.approx((step + 1) * BLOCK_S)
                    assert not coming.done(), "it is ahead of one that has not done"
                coming.cancel()
                await asyncio.wait([coming])


async def test_an_air_ends_when_it_is_told_to(tmp_path):
    """The end may be in the middle of a block; the hub still answers."""
    with lockstep(tmp_path, {1: RadioParams()}, until_s=10.5 * BLOCK_S):
        async with opened(EtherRadio(hub_in(tmp_path), 1, "")) as radio:
            blocks = radio.blocks()
            taken = await take(blocks, 10.5 * N)
            coming = asyncio.ensure_future(anext(blocks))
            await until(lambda: ask(tmp_path).is_over)
            await turn()
            assert not coming.done()
            assert taken[-1].index + taken[-1].n == 10.5 * N
            assert ask(tmp_path).now_s == 10.5 * BLOCK_S
            coming.cancel()
            await asyncio.wait([coming])


async def test_who_comes_when_it_has_begun_is_refused(tmp_path):
    with lockstep(tmp_path, {1: RadioParams()}):
        async with opened(EtherRadio(hub_in(tmp_path), 1, "")) as radio:
            await take(radio.blocks(), N)
            with pytest.raises(BackendError, match="robot 2 joined too late: in lock-step"):
                async with opened(EtherRadio(hub_in(tmp_path), 2, "")):
                    pass


@pytest.mark.parametrize("watched", [False, True])
async def test_a_radio_that_vanishes_does_not_stop_the_others(tmp_path, monkeypatch, watched):
    """It sends no Bye and leaves its step unfinished, possibly while other messages wait."""
    monkeypatch.setattr(*CONSTANTS["hub_look_after_ms"], 200)
    with lockstep(tmp_path, THREE), HubWatch(tmp_path) as watch, RawRadio(tmp_path) as raw:
        token = raw.join(3)
        is_over = threading.Event()

        def keep_asking():
            while not is_over.is_set():
                watch.ask()

        asking = threading.Thread(target=keep_asking, daemon=True)
        async with asyncio.timeout(5):
            async with (
                opened(EtherRadio(hub_in(tmp_path), 1, "")) as one,
                opened(EtherRadio(hub_in(tmp_path), 2, "")) as two,
            ):
                both = [asyncio.ensure_future(take(each.blocks(), 50 * N)) for each in (one, two)]
                raw.push(protocol.Done(token=token, step=0))
                step = (await asyncio.to_thread(raw.hear, protocol.Stretch)).step
                raw.push(protocol.Done(token=token, step=step))
                await until(lambda: ask(tmp_path).now_s > BLOCK_S)
                if watched:
                    asking.start()
                try:
                    raw.vanish()
                    taken = [await each for each in both]
                finally:
                    is_over.set()
                    if watched:
                        asking.join()
        assert 3 not in ask(tmp_path).nodes
    for blocks in taken:
        assert [block.index for block in blocks] == list(range(0, 50 * N, N))


async def test_a_radio_that_leaves_does_not_stop_the_others(tmp_path, monkeypatch):
    """It may also leave before the air has begun; the hub does not have to wait for a timeout."""
    monkeypatch.setattr(*CONSTANTS["hub_look_after_ms"], 60_000)
    with lockstep(tmp_path, THREE):
        async with opened(EtherRadio(hub_in(tmp_path), 3, "")):
            pass
        async with opened(EtherRadio(hub_in(tmp_path), 1, "")) as one:
            async with opened(EtherRadio(hub_in(tmp_path), 2, "")) as two:
                coming = asyncio.ensure_future(take(one.blocks(), 30 * N))
                await take(two.blocks(), 10 * N)
            assert len(await coming) == 30


@pytest.mark.parametrize("says_bye", [True, False])
async def test_a_robot_that_is_started_again_before_the_air_begins_is_who_it_was(
    tmp_path, says_bye
):
    """It gets its own radio back."""
    radios = {1: RadioParams(full_duplex=False), 2: RadioParams()}
    with lockstep(tmp_path, radios), RawRadio(tmp_path) as raw:
        token = raw.join(1)
        if says_bye:
            raw.push(protocol.Bye(token=token))
            await until(lambda: ask(tmp_path).nodes == {})
        else:
            raw.vanish()
        async with opened(EtherRadio(hub_in(tmp_path), 1, "")) as again:
            assert not again.capabilities.full_duplex
            async with opened(EtherRadio(hub_in(tmp_path), 2, "")) as other:
                coming = asyncio.ensure_future(take(other.blocks(), 3 * N))
                await take(again.blocks(), 3 * N)
                await coming


async def test_what_is_sent_before_the_first_block_leaves_with_it(tmp_path):
    """The other robots may be present already or not."""
    starts = []
    for others_first in (False, True):
        folder = tmp_path / f"{others_first}"
        with lockstep(folder, dict.fromkeys((1, 2), RadioParams())):
            async with opened(EtherRadio(hub_in(folder), 1, "")) as one:
                if not others_first:
                    sending = one.send(TxBurst(0, noise(10)))
                async with opened(EtherRadio(hub_in(folder), 2, "")) as two:
                    hearing = asyncio.ensure_future(take(two.blocks(), 5 * N))
                    if others_first:
                        await asyncio.sleep(0.05)
                        sending = one.send(TxBurst(0, noise(10)))
                    await take(one.blocks(), 5 * N)
                    await hearing
                    starts.append((await sending).start)
    assert starts[0] == starts[1]


async def test_in_whatever_order_bursts_come_in_they_sound_the_same(tmp_path):
    """The sum of three depends on their order in its last bit."""
    heard = []
    for order in ([1, 2, 3], [3, 1, 2], [2, 3, 1]):
        folder = tmp_path / "".join(map(str, order))
        with (
            lockstep(folder, dict.fromkeys((1, 2, 3, 4), RadioParams())),
            contextlib.ExitStack() as stack,
        ):
            raws = {node: stack.enter_context(RawRadio(folder)) for node in (1, 2, 3)}
            tokens = {node: raw.join(node) for node, raw in raws.items()}
            # All on one socket, which keeps their order.
            push = raws[1].push
            for node in order:
                sent = protocol.Sent(
                    token=tokens[node], number=1, start=3 * N, latest=3 * N, late_seen=0
                )
                push(sent, noise(150, node).tobytes())
            async with opened(EtherRadio(hub_in(folder), 4, "")) as radio:
                coming = asyncio.ensure_future(take(radio.blocks(), 4 * N))
                for step, node in itertools.product(range(5), raws):
                    push(protocol.Done(token=tokens[node], step=step))
                heard.append((await coming)[-1].samples)
    assert np.abs(heard[0][:150]).mean() > 0.05
    assert heard[0].tobytes() == heard[1].tobytes() == heard[2].tobytes()


@pytest.mark.parametrize("exact", [True, False])
async def test_nothing_overtakes_a_burst_that_was_late(tmp_path, exact):
    """A burst handed over after a late one, before its report, is late too if it has a `latest`."""
    with lockstep(tmp_path, {1: RadioParams()}):
        async with opened(EtherRadio(hub_in(tmp_path), 1, "")) as radio:
            blocks = radio.blocks()
            await take(blocks, N)
            late = TxBurst(0, noise(10), latest=0)
            behind = [
                TxBurst(start, noise(10), start if exact else None) for start in (5 * N, 6 * N)
            ]
            reports, _ = await send(radio, blocks, [late, *behind])
            expected = TxOutcome.LATE if exact else TxOutcome.SENT
            outcomes = [report.outcome for report in reports]
            assert outcomes == [TxOutcome.LATE, expected, expected]
            again = TxBurst(20 * N, noise(10), latest=20 * N)
            (report,), _ = await send(radio, blocks, [again])
            assert (report.outcome, report.start) == (TxOutcome.SENT, 20 * N)
            assert radio.counters["late"] == (3 if exact else 1)


@pytest.mark.parametrize("turns", range(5))
async def test_who_is_cancelled_just_when_something_comes_stops(tmp_path, turns):
    """No block comes, because another robot is missing."""
    with lockstep(tmp_path, dict.fromkeys((1, 2), RadioParams())), RawRadio(tmp_path) as raw:
        async with opened(EtherRadio(hub_in(tmp_path), 1, "")) as radio:
            taking = asyncio.ensure_future(take(radio.blocks()))
            await asyncio.sleep(0.02)
            # The hub asks whether the radio is there, before it refuses another one as robot 1.
            raw.greet(1)
            raw.hear(protocol.Refused)
            for _ in range(turns):
                await asyncio.sleep(0)
            taking.cancel()
            await asyncio.wait({taking}, timeout=5)
            assert taking.cancelled()
