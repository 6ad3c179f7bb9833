"""What every radio keeps to."""

import asyncio
import itertools
import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from backends import TxBurst, TxOutcome
from backends.feed import MAX_WAITING
from backends.outstanding import GAP, Outstanding
from tests.backends.radios import (
    PLAYED,
    RADIOS,
    N,
    bursts,
    hand_over,
    heard,
    noise,
    opened,
    send,
    take,
    turn,
)

FAR = 10**9
every_radio = pytest.mark.parametrize("case", RADIOS, ids=str)
players = pytest.mark.parametrize(
    "case", [case for case in RADIOS if case.receives and not case.hears_self], ids=str
)
transmitters = pytest.mark.parametrize("case", [case for case in RADIOS if case.transmits], ids=str)


@pytest.fixture(autouse=True)
def _patient_loopback(monkeypatch):
    """Its gaps have a test of their own; here, a slow machine must not make any."""
    monkeypatch.setattr("backends.loopback.MAX_BEHIND_S", 1e6)


def assert_sent(burst, report):
    assert report.outcome is TxOutcome.SENT
    assert report.start >= burst.start
    assert report.end == report.start + len(burst.samples)


def assert_only(recorded, sent):
    """`recorded` holds each (burst, report) once, turned in phase at most, and nothing else."""
    rest = recorded.copy()
    for burst, report in sent:
        got = recorded[report.start : report.end]
        phase = np.vdot(burst.samples, got) / np.vdot(burst.samples, burst.samples)
        assert np.abs(phase) == pytest.approx(1, abs=1e-5)
        assert np.abs(got - phase * burst.samples).max() < 1e-5
        rest[report.start : report.end] = 0
    assert not rest.any()


@every_radio
async def test_blocks_are_contiguous_from_index_0(case, tmp_path):
    async with opened(case.make(tmp_path)) as radio:
        taken = await take(radio.blocks(), 30 * N)
    assert all(block.n > 0 and block.index_uncertainty == 0 for block in taken)
    assert taken[0].index == 0
    for one, other in itertools.pairwise(taken):
        assert other.index == one.index + one.n
        assert other.host_ns >= one.host_ns
    for block in taken:
        assert (block.samples is not None) is case.receives
        if block.samples is None:
            assert block.gap_reason
        else:
            assert not block.gap_reason
            assert (block.samples.dtype, block.samples.shape) == (np.complex64, (block.n,))


@players
async def test_what_is_played_is_received_to_its_end(case, tmp_path):
    async with opened(case.make(tmp_path)) as radio:
        taken = await take(radio.blocks())
    assert np.array_equal(heard(taken), PLAYED)


@transmitters
@pytest.mark.parametrize("seed", [1, 2, 3])
async def test_bursts_leave_in_order_without_overlap_as_they_are(case, seed, tmp_path):
    wanted = bursts(seed)
    async with opened(case.make(tmp_path)) as radio:
        reports, taken = await send(radio, radio.blocks(), wanted)
    for burst, report in zip(wanted, reports, strict=True):
        assert_sent(burst, report)
    for one, other in itertools.pairwise(reports):
        assert other.start >= one.end + GAP
    assert reports[0].start == wanted[0].start
    assert_only(case.recorded(tmp_path, taken), zip(wanted, reports, strict=True))


@transmitters
async def test_a_report_comes_with_the_block_of_the_last_sample(case, tmp_path):
    wanted = [TxBurst(1000, noise(500)), TxBurst(1700, noise(1)), TxBurst(1900, noise(20 * N))]
    settled = []
    async with opened(case.make(tmp_path)) as radio:
        sends = await hand_over(radio, wanted)
        async for block in radio.blocks():
            await turn()
            for each, burst in zip(sends, wanted, strict=True):
                passed = block.index + block.n >= burst.start + len(burst.samples)
                assert each.done() == passed
                if each.done() and each not in settled:
                    settled.append(each)
            if len(settled) == len(sends):
                break
        assert settled == sends


@transmitters
async def test_a_burst_too_late_leaves_as_soon_as_it_can(case, tmp_path):
    late = TxBurst(0, noise(300))
    async with opened(case.make(tmp_path)) as radio:
        blocks = radio.blocks()
        taken = await take(blocks, 10 * N)
        now = taken[-1].index + taken[-1].n
        (report,), more = await send(radio, blocks, [late])
        assert_sent(late, report)
        assert report.start >= now
        # Blocks that wait were made before it came; paced, late blocks may be larger.
        if not radio.capabilities.paced:
            assert report.start <= now + (MAX_WAITING + 1) * N
    assert_only(case.recorded(tmp_path, taken + more), [(late, report)])


@transmitters
async def test_an_exact_burst_leaves_when_asked_or_not_at_all(case, tmp_path):
    begin, n = 30_000, 400
    end = begin + n
    asked = [
        (TxBurst(0, noise(n), exact=True), None),
        (TxBurst(begin, noise(n), exact=True), begin),
        (TxBurst(begin + 100, noise(n), exact=True), None),
        (TxBurst(end + GAP - 1, noise(n), exact=True), None),
        (TxBurst(end + GAP, noise(n), exact=True), end + GAP),
        (TxBurst(begin + 100, noise(n)), end + GAP + n + GAP),
    ]
    async with opened(case.make(tmp_path)) as radio:
        blocks = radio.blocks()
        taken = await take(blocks, N)
        reports, more = await send(radio, blocks, [burst for burst, _ in asked])
        assert radio.counters["late"] == 3
    for (burst, start), report in zip(asked, reports, strict=True):
        if start is None:
            assert report.outcome is TxOutcome.LATE
        else:
            assert_sent(burst, report)
            assert report.start == start
    sent = [
        (burst, report)
        for (burst, start), report in zip(asked, reports, strict=True)
        if start is not None
    ]
    assert_only(case.recorded(tmp_path, taken + more), sent)


@settings(derandomize=True, deadline=None, max_examples=100)
@given(
    st.lists(
        st.tuples(st.integers(-10, 3000), st.integers(0, 400), st.booleans(), st.integers(0, 300)),
        max_size=30,
    )
)
def test_any_bursts_are_placed_one_after_another(asked):
    outstanding = Outstanding()
    now, free_from = 0, 0
    for start, n, exact, later in asked:
        now += later
        placed = outstanding.place(TxBurst(start, np.zeros(n, np.complex64), exact), now)
        if exact and start < max(now, free_from):
            assert placed is None
            continue
        assert placed == max(start, now, free_from)
        free_from = placed + n + GAP


@transmitters
async def test_closing_settles_what_has_not_left_as_lost(case, tmp_path):
    sent, far = TxBurst(100, noise(50)), [TxBurst(FAR, noise(30)), TxBurst(FAR, noise(40))]
    async with opened(case.make(tmp_path)) as radio:
        sends = await hand_over(radio, [sent, *far])
        taken = await take(radio.blocks(), 2 * N)
        assert [each.done() for each in sends] == [True, False, False]
        await radio.close()
        reports = await asyncio.gather(*sends)
    outcomes = [report.outcome for report in reports]
    assert outcomes == [TxOutcome.SENT, TxOutcome.LOST, TxOutcome.LOST]
    recorded = case.recorded(tmp_path, taken)
    assert len(recorded) < 100 * N, "nothing is recorded of what was to come"
    assert_only(recorded, [(sent, reports[0])])


@every_radio
async def test_closing_ends_blocks_and_the_thread(case, tmp_path):
    before = set(threading.enumerate())
    async with opened(case.make(tmp_path)) as radio:
        begun = asyncio.Event()

        async def take_all():
            async for _ in radio.blocks():
                begun.set()

        taking = asyncio.ensure_future(take_all())
        await begun.wait()
        assert set(threading.enumerate()) - before
        await radio.close()
        await taking
    assert set(threading.enumerate()) <= before


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
        assert not case.recorded(tmp_path, []).any()


@every_radio
async def test_a_radio_that_is_not_open_sends_nothing(case, tmp_path):
    report = await case.make(tmp_path).send(TxBurst(0, noise(10)))
    assert report.outcome is TxOutcome.LOST


@every_radio
async def test_a_radio_says_what_it_can_do(case, tmp_path):
    radio = case.make(tmp_path)
    can = radio.capabilities
    assert (can.receives, can.transmits, can.paced) == (case.receives, case.transmits, case.paced)
    assert radio.detail
    assert not any(radio.counters.values())
    if not can.transmits:
        async with opened(radio):
            assert (await radio.send(TxBurst(0, noise(10)))).outcome is TxOutcome.LOST


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


@every_radio
async def test_few_blocks_wait_for_a_consumer_that_stopped(case, tmp_path):
    radio = case.make(tmp_path)
    made, full = [], threading.Event()
    make = radio._feed._next_block

    def counted():
        made.append(make())
        if len(made) > MAX_WAITING:
            full.set()
        return made[-1]

    radio._feed._next_block = counted
    async with opened(radio):
        blocks = radio.blocks()
        await take(blocks, 1)
        assert await asyncio.to_thread(full.wait, 20)
        # Nothing tells that a thread does not go on; without a bound it would within this time.
        await asyncio.sleep(0.05)
        assert len(made) == 1 + MAX_WAITING
        # All that waited is still there, and the stream goes on behind it.
        taken = await take(blocks, made[-1].index + made[-1].n + 2 * N)
        waited = made[1 : 1 + MAX_WAITING]
        assert [block.index for block in taken[:MAX_WAITING]] == [block.index for block in waited]
