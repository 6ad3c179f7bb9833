"""Radios without time stamps: each gap shifts their count of samples a little."""

import numpy as np
import pytest

from backends import Antenna, TxBurst, TxOutcome
from backends.testing import Piece
from tests.backends.airs import PLAIN, RATE, half_duplex
from tests.backends.nodes import N, assert_contiguous, ether_of, line_of, run, sending
from tests.backends.radios import noise

ERROR = 40
"""Possible error of the count after a gap, in samples."""
N_GAPS = 8
EVERY = 20_000
BEGIN = 5000
MARK = noise(400, seed=3)


def unsure(**more):
    return half_duplex(timestamps=False, index_error_s=ERROR / RATE, **more)


def found(line, near):
    """Start of the mark near the index `near`."""
    first = near - 1000
    part = line[first : near + 1000 + len(MARK)]
    return first + int(np.argmax(np.abs(np.correlate(part, MARK, "valid"))))


async def gaps_and_marks(burst_n, seed, **radio):
    """(blocks of node 0, positions of its marks in its own count minus those in the air's count).

    Node 0 sends bursts of that length, node 1 a mark before each and after the last.
    """
    ether = ether_of({0: unsure(**radio), 1: PLAIN}, seed=seed, snr_db=30.0)
    # In the air's count; node 0 hands over its own burst at its estimate of the present.
    marks = [BEGIN + i * EVERY for i in range(N_GAPS + 1)]
    reports = []
    wanted = [(at - 2 * N, TxBurst(at, MARK, latest=at)) for at in marks]
    gaps = [(at + 2 * N, TxBurst(at + 4 * N, noise(burst_n))) for at in marks[:-1]]
    taken = await run(
        ether,
        (marks[-1] + 2 * N) / RATE,
        {0: sending(ether.radios[0], gaps, reports), 1: sending(ether.radios[1], wanted, reports)},
    )
    assert {(await each).outcome for each in reports} == {TxOutcome.SENT}
    line = line_of(taken[0])
    return taken[0], np.array([found(line, at) - at for at in marks])


# Within one block, and over several.
@pytest.mark.parametrize("burst_n", [300, 5500])
@pytest.mark.parametrize("seed", [1, 2, 3])
async def test_after_each_gap_the_index_is_off_by_no_more_than_told(burst_n, seed):
    blocks, errors = await gaps_and_marks(burst_n, seed)
    slips = np.diff(errors)
    assert errors[0] == 0, "before the first gap it is right"
    assert np.abs(slips).max() <= ERROR, slips
    assert len(set(slips)) > N_GAPS // 2, "they are chance"
    assert_contiguous(blocks)
    first_gap = next(block.index for block in blocks if block.samples is None)
    for block in blocks:
        assert block.index_uncertainty == (ERROR if block.index >= first_gap else 0)


async def test_a_burst_leaves_where_the_radio_takes_its_index_to_be():
    """The burst is off by as much as everything that the radio hears."""
    ether = ether_of({0: unsure(), 1: PLAIN}, snr_db=30.0)
    mark_at, begin = 15_000, 20_000
    mine, others = [], []
    wanted = [(N, TxBurst(5000, noise(300))), (16_000, TxBurst(begin, MARK, latest=begin))]
    taken = await run(
        ether,
        0.03,
        {
            0: sending(ether.radios[0], wanted, mine),
            1: sending(ether.radios[1], [(N, TxBurst(mark_at, MARK))], others),
        },
    )
    report = await mine[1]
    assert (report.outcome, report.start, report.end) == (TxOutcome.SENT, begin, begin + 400)
    error = found(line_of(taken[0]), mark_at) - mark_at
    assert error, "there is something to see"
    assert found(line_of(taken[1]), begin) == begin - error


async def test_a_gap_that_is_cut_short_still_has_samples():
    """However far the index slips, no block is empty or runs backwards."""
    ether = ether_of({0: unsure(turnaround_s=0.0), 1: PLAIN})
    wanted = [(i * N, TxBurst(i * N + 1500, noise(1 + i % 3))) for i in range(1, 40)]
    taken = await run(ether, 0.045, {0: sending(ether.radios[0], wanted, [])})
    gaps = [block.n for block in taken[0] if block.samples is None]
    assert_contiguous(taken[0])
    assert len(gaps) >= 39
    assert min(gaps) == 1
    assert max(gaps) > 3


async def test_with_time_stamps_the_index_is_right_after_any_gap():
    blocks, errors = await gaps_and_marks(3000, 1)
    assert errors.any(), "without them it is not"
    ether = ether_of({0: half_duplex(index_error_s=ERROR / RATE), 1: PLAIN}, snr_db=30.0)
    taken = await run(
        ether,
        0.02,
        {
            0: sending(ether.radios[0], [(N, TxBurst(5000, noise(3000)))], []),
            1: sending(ether.radios[1], [(N, TxBurst(15_000, MARK))], []),
        },
    )
    assert found(line_of(taken[0]), 15_000) == 15_000
    assert not any(block.index_uncertainty for block in taken[0])
    assert blocks[-1].index_uncertainty == ERROR


def test_blocks_that_were_missed_are_as_unsure_as_those_around_them():
    antenna = Antenna(unsure(), 1, RATE)
    deaf = Piece(500, None, is_deaf=True)
    assert antenna.miss(100, "lost", 0).index_uncertainty == 0
    assert antenna.receive(deaf, 0).index_uncertainty == ERROR
    assert antenna.miss(100, "lost", 0).index_uncertainty == ERROR
    assert antenna.receive(Piece(500, None, is_deaf=False), 0).index_uncertainty == ERROR
