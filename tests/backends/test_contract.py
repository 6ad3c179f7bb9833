"""The contract of every radio: its stream, and how it sends bursts."""

import asyncio
import itertools

import numpy as np
import pytest

from backends import GAP, BackendError, TxBurst, TxOutcome
from backends.testing import MAX_WAITING
from tests.backends.cases import (
    assert_only,
    every_radio,
    not_in_lockstep,
    players,
    transceivers,
    transmitters,
)
from tests.backends.radios import (
    PLAYED,
    RATE,
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

pytestmark = pytest.mark.usefixtures("at_ease")
TRIES = 5
"""How often a radio in real time that was late is tried."""


def assert_sent(burst, report):
    assert report.outcome is TxOutcome.SENT
    assert report.start >= burst.start
    assert report.end == report.start + len(burst.samples)


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
    wanted = [burst._replace(start=case.begin + burst.start) for burst in bursts(seed)]
    async with opened(case.make(tmp_path)) as radio:
        reports, taken = await send(radio, radio.blocks(), wanted)
    for burst, report in zip(wanted, reports, strict=True):
        assert_sent(burst, report)
    for one, other in itertools.pairwise(reports):
        assert other.start >= one.end + GAP
    assert reports[0].start == wanted[0].start
    assert_only(case, case.recorded(tmp_path, taken), zip(wanted, reports, strict=True))


@transmitters
async def test_a_report_comes_with_the_block_of_the_last_sample(case, tmp_path):
    wanted = [
        TxBurst(case.begin + start, noise(n))
        for start, n in ((1000, 500), (1700, 1), (1900, 20 * N))
    ]
    settled = []
    async with opened(case.make(tmp_path)) as radio:
        sends = await hand_over(radio, wanted)
        async for block in radio.blocks():
            await turn()
            for each, burst in zip(sends, wanted, strict=True):
                passed = block.index + block.n >= burst.start + len(burst.samples)
                assert each.done() == passed or not case.settles_with_blocks
                if each.done() and each not in settled:
                    settled.append(each)
            if len(settled) == len(sends):
                break
        assert settled == sends


@transmitters
async def test_a_burst_too_late_leaves_as_soon_as_it_can(case, tmp_path):
    late = TxBurst(0, noise(300))
    for attempt in range(TRIES):
        folder = tmp_path / str(attempt)
        folder.mkdir()
        async with opened(case.make(folder)) as radio:
            blocks = radio.blocks()
            taken = await take(blocks, 10 * N)
            now = taken[-1].index + taken[-1].n
            (report,), more = await send(radio, blocks, [late])
        is_late = report.outcome is TxOutcome.LATE or getattr(radio, "is_recorded_late", False)
        if case.paced and is_late:
            continue  # The radio says itself that this machine was too busy for real time.
        assert_sent(late, report)
        assert report.start >= now
        # Waiting blocks were made before the burst; paced, late blocks may be larger.
        if not case.paced:
            assert report.start <= now + (MAX_WAITING + 1) * N
        assert_only(case, case.recorded(folder, taken + more), [(late, report)])
        return
    pytest.fail("this machine is too busy for radios in real time")


@transmitters
async def test_a_burst_leaves_in_its_time_or_not_at_all(case, tmp_path):
    begin, n = 30_000, 400
    end = begin + n
    free_at = begin + 3 * (n + GAP)
    # After a late burst, the next ones are handed over when its report has come.
    asked = [
        [(TxBurst(0, noise(n), latest=0), None)],
        [(TxBurst(begin, noise(n), latest=begin), begin)],
        [(TxBurst(begin + 100, noise(n), latest=begin + 100), None)],
        [(TxBurst(end + GAP - 1, noise(n), latest=end + GAP - 1), None)],
        [
            (TxBurst(end + GAP, noise(n), latest=end + GAP), end + GAP),
            (TxBurst(begin + 100, noise(n)), end + GAP + n + GAP),
            (TxBurst(end, noise(n), latest=free_at), free_at),
        ],
        [(TxBurst(end, noise(n), latest=free_at), None)],
        [
            (TxBurst(free_at + n + GAP, noise(n), latest=free_at + 2 * n), free_at + n + GAP),
        ],
    ]
    sends = []
    async with opened(case.make(tmp_path)) as radio:
        blocks = radio.blocks()
        taken = await take(blocks, N)
        for group in asked:
            begun = await hand_over(radio, [burst for burst, _ in group])
            sends += zip(begun, group, strict=True)
            while not all(each.done() for each, (_, start) in sends if start is None):
                taken += await take(blocks, 1)
        while not all(each.done() for each, _ in sends):
            taken += await take(blocks, 1)
        assert radio.counters["late"] == 4
    sent = []
    for each, (burst, start) in sends:
        report = await each
        if start is None:
            assert report.outcome is TxOutcome.LATE
        else:
            assert_sent(burst, report)
            assert report.start == start
            sent.append((burst, report))
    assert_only(case, case.recorded(tmp_path, taken), sent)


@every_radio
async def test_a_radio_says_what_it_can_do(case, tmp_path):
    async with opened(case.make(tmp_path)) as radio:
        can = radio.capabilities
        assert (can.receives, can.transmits) == (case.receives, case.transmits)
        assert (can.paced, can.lockstep) == (case.paced, case.lockstep)
        assert (can.full_duplex, can.turnaround_s) == (case.full_duplex, case.turnaround_s)
        assert can.timestamps
        assert can.block_s * RATE == N
        assert radio.detail
        assert not any(radio.counters.values())
        if not can.transmits:
            assert (await radio.send(TxBurst(0, noise(10)))).outcome is TxOutcome.LOST


@transceivers
async def test_a_radio_misses_what_its_own_bursts_cover_only_when_half_duplex(case, tmp_path):
    """From the turnaround before to the turnaround after each burst; each gap has a reason."""
    wanted = [TxBurst(case.begin + start, noise(n)) for start, n in ((1000, 500), (2000, 1))]
    async with opened(case.make(tmp_path)) as radio:
        _, taken = await send(radio, radio.blocks(), wanted)
    missing = [i for b in taken if b.samples is None for i in range(b.index, b.index + b.n)]
    turnaround, end = round(case.turnaround_s * RATE), taken[-1].index + taken[-1].n
    spans = [] if case.full_duplex else [(b.start, b.start + len(b.samples)) for b in wanted]
    deaf = [i for begin, end in spans for i in range(begin - turnaround, end + turnaround)]
    assert missing == [i for i in deaf if i < end]
    assert all(bool(block.gap_reason) == (block.samples is None) for block in taken)


@every_radio
async def test_what_is_heard_where_it_is_made_is_not_yielded(case, tmp_path):
    """Reports still come. A radio without a thread yields everything."""
    there, wanted = [], []
    if case.transmits:
        wanted = [TxBurst(case.begin + start, noise(500)) for start in (1000, 2500, 9000)]
    async with opened(case.make(tmp_path)) as radio:
        sends = await hand_over(radio, wanted)
        here = []

        async def listen():
            async for block in radio.blocks(there.append):
                here.append(block)
                await turn()

        listening = asyncio.ensure_future(listen())
        while len(there) + len(here) < 30 or not all(each.done() for each in sends):
            await asyncio.sleep(0)
            if listening.done():
                break
        listening.cancel()
        await asyncio.gather(listening, return_exceptions=True)
        for burst, sent in zip(wanted, sends, strict=True):
            assert_sent(burst, await sent)
    assert bool(there) is not case.lockstep
    taken = sorted([*there, *here], key=lambda block: block.index)
    assert not (there and here)
    assert taken[0].index == 0
    for one, other in itertools.pairwise(taken):
        assert other.index == one.index + one.n


@not_in_lockstep
async def test_what_goes_wrong_where_blocks_are_heard_is_told(case, tmp_path):
    def hear(_):
        raise BackendError("no more of this")

    async with opened(case.make(tmp_path)) as radio:
        with pytest.raises(BackendError, match="no more of this"):
            await take(radio.blocks(hear))
