"""The contract of every radio when it is closed, and with a consumer that stops."""

import asyncio
import threading

import pytest

from backends import TxBurst, TxOutcome
from backends.testing import MAX_WAITING, BlockFeed
from tests.backends.cases import assert_only, every_radio, not_in_lockstep, transmitters
from tests.backends.radios import N, hand_over, noise, opened, take, turn
from tests.waiting import wait_for

FAR = 10**9

pytestmark = pytest.mark.usefixtures("at_ease")


def threads():
    """All threads except those of the loop's own pool, which remain."""
    return {each for each in threading.enumerate() if not each.name.startswith("asyncio_")}


@transmitters
async def test_closing_settles_what_has_not_left_as_lost(case, tmp_path):
    sent = TxBurst(case.begin + 100, noise(50))
    far = [TxBurst(FAR, noise(30)), TxBurst(FAR, noise(40))]
    async with opened(case.make(tmp_path)) as radio:
        sends = await hand_over(radio, [sent, *far])
        taken = await take(radio.blocks(), case.begin + 2 * N)
        assert [each.done() for each in sends] == [True, False, False]
        await radio.close()
        reports = await asyncio.gather(*sends)
    outcomes = [report.outcome for report in reports]
    assert outcomes == [TxOutcome.SENT, TxOutcome.LOST, TxOutcome.LOST]
    recorded = case.recorded(tmp_path, taken)
    assert len(recorded) < FAR / 100, "nothing is recorded of what was to come"
    assert_only(case, recorded, [(sent, reports[0])])


@every_radio
async def test_closing_ends_blocks_and_the_thread(case, tmp_path):
    before = threads()
    async with opened(case.make(tmp_path)) as radio:
        begun, without_blocks = asyncio.Event(), threads()

        async def take_all():
            async for _ in radio.blocks():
                begun.set()

        taking = asyncio.ensure_future(take_all())
        await begun.wait()
        assert case.lockstep or threads() - without_blocks
        await radio.close()
        await taking
    assert threads() <= before


@every_radio
async def test_a_closed_radio_leaves_nothing_on_the_event_loop(case, tmp_path):
    """Its consumer may still be busy; a watched descriptor may soon be reused."""
    # asyncio has no public name for what it watches.
    watched = asyncio.get_running_loop()._selector.get_map()  # noqa: SLF001
    async with opened(case.make(tmp_path)) as radio:
        before = set(watched)
        blocks = radio.blocks()
        await anext(blocks)
        await radio.close()
        assert set(watched) <= before
        await blocks.aclose()


@every_radio
async def test_closing_is_fine_at_any_time(case, tmp_path):
    radio = case.make(tmp_path)
    await radio.close()
    for with_blocks in (False, True):
        async with opened(case.make(tmp_path)) as radio:
            sends = await hand_over(radio, [TxBurst(FAR, noise(10))])
            if with_blocks:
                await take(radio.blocks(), 1)
            await radio.close()
            await radio.close()
            assert [(await each).outcome for each in sends] == [TxOutcome.LOST]


@every_radio
async def test_what_a_closed_radio_is_given_is_lost(case, tmp_path):
    async with opened(case.make(tmp_path)) as radio:
        await take(radio.blocks(), N)
    report = await radio.send(TxBurst(FAR, noise(10)))
    assert report.outcome is TxOutcome.LOST
    if case.transmits:
        assert_only(case, case.recorded(tmp_path, []), [])


@every_radio
async def test_a_radio_that_is_not_open_sends_nothing(case, tmp_path):
    radio = case.make(tmp_path)
    assert (await radio.send(TxBurst(0, noise(10)))).outcome is TxOutcome.LOST
    await radio.close()


@every_radio
async def test_what_is_sent_when_the_stream_is_over_is_lost(case, tmp_path):
    async with opened(case.make(tmp_path)) as radio:
        blocks = radio.blocks()
        await anext(blocks)
        await blocks.aclose()
        async with asyncio.timeout(1):
            assert (await radio.send(TxBurst(FAR, noise(10)))).outcome is TxOutcome.LOST


@every_radio
async def test_a_consumer_that_went_away_does_not_keep_a_radio_open(case, tmp_path):
    async with opened(case.make(tmp_path)) as radio:
        sends = await hand_over(radio, [TxBurst(FAR, noise(10))])
        taking = asyncio.ensure_future(take(radio.blocks()))
        await turn()
        taking.cancel()
        with pytest.raises(asyncio.CancelledError):
            await taking
        await radio.close()
        assert (await sends[0]).outcome is TxOutcome.LOST


@not_in_lockstep
async def test_few_blocks_wait_for_a_consumer_that_stopped(case, tmp_path, monkeypatch):
    """An air may have other radios, with feeds of their own."""
    feeds, fed = [], BlockFeed.__init__

    def feed(self, next_block, *more, **named):
        made = []
        feeds.append(made)

        def counted():
            made.append(next_block())
            return made[-1]

        fed(self, counted, *more, **named)

    monkeypatch.setattr(BlockFeed, "__init__", feed)
    async with opened(case.make(tmp_path)) as radio:
        blocks = radio.blocks()
        first, *_ = await take(blocks, 1)
        (made,) = (each for each in feeds if any(block is first for block in each))
        await asyncio.to_thread(wait_for, lambda: len(made) > MAX_WAITING)
        # Nothing shows that a thread is blocked; without a bound it would go on within this time.
        await asyncio.sleep(0.05)
        assert len(made) == 1 + MAX_WAITING
        # All waiting blocks are still there, and the stream continues after them.
        taken = await take(blocks, made[-1].index + made[-1].n + 2 * N)
        waited = made[1 : 1 + MAX_WAITING]
        assert [block.index for block in taken[:MAX_WAITING]] == [block.index for block in waited]
