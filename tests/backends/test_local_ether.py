"""Radios on one air inside this process stay in step, whatever each does between its blocks."""

import asyncio
from random import Random

import numpy as np
import pytest

from backends import (
    GAP,
    BackendError,
    JammerParams,
    LinkOverride,
    RadioParams,
    Tuning,
    TxBurst,
    TxOutcome,
)
from backends.testing import LEAD, NOISE_DBFS
from tests.backends.airs import CENTRE_HZ, PLAIN, RATE, burst, half_duplex, power_db
from tests.backends.nodes import (
    BLOCK_S,
    N,
    above_noise,
    assert_contiguous,
    ether_of,
    line_of,
    run,
    sending,
    tone,
)
from tests.backends.radios import noise, turn


async def test_a_burst_is_heard_by_all_others_where_its_report_says():
    ether = ether_of(dict.fromkeys((3, 5, 9), PLAIN), snr_db=40.0)
    reports = []
    wanted = [(N, tone(1500, 700)), (N, tone(1800, 100)), (2 * N, tone(9000, 1))]
    taken = await run(ether, 0.012, {5: sending(ether.radios[5], wanted, reports)})
    settled = [await each for each in reports]
    assert [report.outcome for report in settled] == [TxOutcome.SENT] * 3
    spans = [(1500, 2200), (2200 + GAP, 2300 + GAP), (9000, 9001)]
    assert [(report.start, report.end) for report in settled] == spans
    where = [i for begin, end in spans for i in range(begin, end)]
    assert above_noise(line_of(taken[3])) == above_noise(line_of(taken[9])) == where
    assert not above_noise(line_of(taken[5]))
    for blocks in taken.values():
        assert_contiguous(blocks)
        assert [block.n for block in blocks] == [N] * 12


async def test_a_report_comes_with_the_block_of_the_last_sample():
    ether = ether_of({0: half_duplex(0.0003), 1: PLAIN})
    radio, reports, ends = ether.radios[0], [], []

    async def react(block):
        if not reports:
            bursts = tone(1500, 1700), tone(5000, 2000)
            reports.extend(radio.send(each) for each in bursts)
        ends.append((block.index + block.n, [each.done() for each in reports]))

    await run(ether, 0.01, {0: react})
    for end, done in ends:
        assert done == [end >= 3200, end >= 7000], end


async def test_bursts_arrive_above_a_radios_own_noise_by_their_snr():
    links = [LinkOverride(sender=0, receiver=1, snr_db=13.0)]
    ether = ether_of({0: PLAIN, 1: PLAIN}, links=links)
    wanted = [(N, TxBurst(10_000, noise(20_000)))]
    taken = await run(ether, 0.04, {0: sending(ether.radios[0], wanted, [])})
    got = line_of(taken[1])
    quiet, both = power_db(got[:10_000]), power_db(got[10_000:30_000])
    assert quiet == pytest.approx(NOISE_DBFS, abs=0.15)
    assert both == pytest.approx(NOISE_DBFS + 10 * np.log10(10**1.3 + 1), abs=0.1)
    assert not np.array_equal(got[:N], line_of(taken[0])[:N]), "each has noise of its own"


async def test_all_hear_a_jammer_alike_and_only_while_it_sends():
    """A half-duplex radio, too, whose own bursts leave gaps in what it hears."""
    jammer = JammerParams(over_noise_db=40.0, offset_hz=1e5, times=[[0.01, 0.02]])
    ether = ether_of({0: half_duplex(0.0003), 1: PLAIN}, snr_db=-300.0, jammer=[jammer])
    wanted = [(N, TxBurst(12_000, noise(2000)))]
    taken = await run(ether, 0.03, {0: sending(ether.radios[0], wanted, [])})
    got, other = line_of(taken[1]), line_of(taken[0])
    on = slice(10_000, 20_000)
    assert power_db(got[on]) == pytest.approx(NOISE_DBFS + 40, abs=0.05)
    for off in (slice(0, 10_000), slice(20_000, 30_000)):
        assert power_db(got[off]) == pytest.approx(NOISE_DBFS, abs=0.15)
    late = slice(15_000, 20_000)
    assert np.abs(got[late] - other[late]).max() < 0.1 * np.abs(got[late]).min()


async def test_an_exact_burst_too_late_is_told_and_not_heard():
    ether = ether_of({0: half_duplex(0.0005), 1: PLAIN})
    radio, reports = ether.radios[0], []
    late = 2 * N + 500 + LEAD - 2
    wanted = [(2 * N, tone(late, 100, exact=True)), (2 * N, tone(late + 1, 100, exact=True))]
    taken = await run(ether, 0.005, {0: sending(radio, wanted, reports)})
    one, other = [await each for each in reports]
    assert one.outcome is TxOutcome.LATE
    assert (other.outcome, other.start) == (TxOutcome.SENT, late + 1)
    assert radio.counters == {"late": 1}
    assert above_noise(line_of(taken[1])) == list(range(late + 1, late + 101))


async def test_no_radio_gets_ahead_of_one_that_dawdles():
    ether = ether_of(dict.fromkeys(range(3), PLAIN))
    ends = dict.fromkeys(ether.radios, 0)
    waits, may_go_on = asyncio.Event(), asyncio.Event()

    async def dawdle(block):
        waits.set()
        await may_go_on.wait()
        may_go_on.clear()
        ends[1] = block.index + block.n

    def hurry(node):
        async def react(block):
            ends[node] = block.index + block.n

        return react

    reacts = {0: hurry(0), 1: dawdle, 2: hurry(2)}
    async with asyncio.TaskGroup() as tasks:
        running = tasks.create_task(run(ether, 0.02, reacts))
        for step in range(20):
            await waits.wait()
            waits.clear()
            for _ in range(5):
                await turn()
            assert ends == {0: (step + 1) * N, 1: step * N, 2: (step + 1) * N}
            may_go_on.set()
    assert {node: len(blocks) for node, blocks in running.result().items()} == {0: 20, 1: 20, 2: 20}


async def hear_a_run(seed, dawdling):
    """All blocks of a run in which three nodes send at random; `dawdling` seeds random delays."""
    radios = {0: PLAIN, 1: half_duplex(0.0002, clock_ppm=12), 2: half_duplex()}
    ether = ether_of(radios, seed=seed, profile="tdl-a")
    idle = Random(dawdling)

    def node(i):
        chance = Random(i)

        async def react(block):
            for _ in range(idle.randrange(4)):
                await asyncio.sleep(0)
            if chance.random() < 0.3:
                start = block.index + block.n + chance.randrange(3 * N)
                ether.radios[i].send(burst(start, 1 + chance.randrange(900), chance.randrange(99)))

        return react

    return await run(ether, 0.04, {i: node(i) for i in radios})


async def test_one_seed_is_one_run_however_nodes_dawdle():
    one, same, other = [await hear_a_run(*seeds) for seeds in ((7, 1), (7, 2), (8, 1))]
    for node, blocks in one.items():
        assert_contiguous(blocks)
        again = same[node]
        assert [block.n for block in blocks] == [block.n for block in again]
        assert line_of(blocks).tobytes() == line_of(again).tobytes()
        assert not np.allclose(line_of(blocks), line_of(other[node]))
    assert len(above_noise(line_of(one[0]))) > 2000, "there is something to hear"


async def test_exact_bursts_in_slots_of_their_own_never_meet():
    """Slots as with TDMA: three half-duplex radios, four frames."""
    slot, n, turnaround = 1500, 1200, 120
    nodes = (0, 1, 2)
    ether = ether_of(dict.fromkeys(nodes, half_duplex(turnaround / RATE)), snr_db=40.0)
    reports = {node: [] for node in nodes}
    begins = {node: [3000 + (3 * i + node) * slot for i in range(4)] for node in nodes}
    reacts = {
        node: sending(
            ether.radios[node],
            # Decided as late as possible: with the last block that ends early enough.
            [((at - turnaround - LEAD) // N * N, tone(at, n, exact=True)) for at in begins[node]],
            reports[node],
        )
        for node in nodes
    }
    taken = await run(ether, 0.024, reacts)
    for node in nodes:
        settled = [await each for each in reports[node]]
        assert [(report.outcome, report.start) for report in settled] == [
            (TxOutcome.SENT, at) for at in begins[node]
        ]
        gaps = [i for b in taken[node] if b.samples is None for i in range(b.index, b.index + b.n)]
        assert gaps == [
            i for at in begins[node] for i in range(at - turnaround, at + n + turnaround)
        ]
        others = sorted(at for other in nodes if other != node for at in begins[other])
        where = [i for at in others for i in range(at, at + n)]
        assert above_noise(line_of(taken[node])) == where


@pytest.mark.parametrize("from_outside", [False, True])
async def test_a_radio_that_is_closed_does_not_stop_the_others(from_outside):
    ether = ether_of(dict.fromkeys(range(3), PLAIN), snr_db=40.0)
    leaving, reports, ends = ether.radios[1], [], []
    wanted = [(N, tone(1500, 300)), (N, tone(50_000, 300))]
    send = sending(leaving, wanted, reports)

    async def leave(block):
        await send(block)
        if not from_outside and block.index == 2 * N:
            await leaving.close()

    async def observe(block):
        ends.append(block.index)
        if from_outside and block.index == 2 * N:
            await leaving.close()

    taken = await run(ether, 0.06, {0: observe, 1: leave})
    assert [(await each).outcome for each in reports] == [TxOutcome.SENT, TxOutcome.LOST]
    for node in (0, 2):
        assert_contiguous(taken[node])
        assert len(taken[node]) == 60
        heard = above_noise(line_of(taken[node]))
        assert heard[:300] == list(range(1500, 1800))
    assert len(taken[1]) <= 4


async def test_a_radio_that_is_not_open_sends_nothing():
    ether = ether_of({0: PLAIN, 1: PLAIN})
    assert (await ether.radios[0].send(tone(0, 100))).outcome is TxOutcome.LOST
    assert ether.medium.bursts == 0


async def test_another_rate_is_refused_with_the_one_of_the_air():
    ether = ether_of({0: PLAIN})
    with pytest.raises(BackendError, match="rate_hz: got 2e\\+06; allowed: 1e\\+06"):
        await ether.radios[0].open(Tuning(2 * RATE, CENTRE_HZ))


def test_a_radio_can_what_its_parameters_say():
    radios = {0: PLAIN, 1: half_duplex(0.0005, timestamps=False, index_error_s=1e-5)}
    one, other = (radio.capabilities for radio in ether_of(radios).radios.values())
    for can in (one, other):
        assert can.receives
        assert can.transmits
        assert can.lockstep
        assert not can.paced
        assert (can.block_s, can.lead_s) == (BLOCK_S, LEAD / RATE)
    assert (one.full_duplex, one.timestamps) == (True, True)
    assert (one.turnaround_s, one.index_error_s) == (0.0, 0.0)
    assert (other.full_duplex, other.timestamps) == (False, False)
    assert (other.turnaround_s, other.index_error_s) == (0.0005, 1e-5)


def test_a_radio_that_always_hears_or_has_time_stamps_has_nothing_to_be_unsure_of():
    ether = ether_of({0: RadioParams(turnaround_s=0.1, index_error_s=0.1)})
    can = ether.radios[0].capabilities
    assert (can.turnaround_s, can.index_error_s) == (0.0, 0.0)
