"""Compares the kernels that learn and follow a burst's channel with the reference.

They may differ only by single-precision rounding and by deliberate simplifications of a kernel.
Each grid and each modulation is compared once, at several noise levels; not each with every other:
they share the code, and differ in tables alone.

Other kernels are compared in `test_reference_acquisition`, and in their own tests: detector and
modulator in `test_kernels`, FFT and demapper in `test_lanes`, LDPC in `test_ldpc`, training in
`test_training`, the K=7 code in `test_coding`.
"""

from itertools import cycle

import numpy as np
import pytest
from numba import njit

from phy import GRIDS, OFDM_64_16, Modulation, kernels, reference
from phy.reference import mapping, ofdm, smoothing, tracking, training
from phy.reference.tracking import Kalman
from phy.testing import (
    DELAY,
    DOUBT,
    N_FOLLOWED,
    PHASE,
    SLOPE,
    SLOPE_USED,
    SPREAD,
    TURNS,
    axes,
    compute,
    new_scratch,
    polarity,
    tones,
)
from tests.phy.channels import assert_same, both_estimates, gains_of, in_tones, trained
from tests.phy.signals import noise

pytestmark = pytest.mark.slow  # together; each is quick

SEED = 79
BLOCK = reference.channel.LONGEST

every_grid = pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)


def rng(more=0):
    return np.random.default_rng(SEED + more)


@every_grid
def test_the_channel_that_training_tells_is_the_same(grid):
    for seed, no in enumerate((1.0, 0.03, 1e-4)):
        y, sent, _ = trained(rng(seed), grid, no)
        block, other = both_estimates(grid, y, sent)
        assert_same(block.content, other, grid)
        assert block.content.figures[DELAY] == pytest.approx(other.delay, abs=1e-4)


@every_grid
def test_what_a_header_tells_besides_is_the_same(grid):
    blanked = (None, None, None, None, 1, 3)
    for seed, (boost, lost) in enumerate(
        zip((0.8, 1.0, 1.41, 5.0, 1.0, 1.0), blanked, strict=True)
    ):
        amplitude = np.array([boost, boost, 1, 1])
        y, sent, _ = trained(rng(seed), grid, 0.02, 4, amplitude)
        block, before = both_estimates(grid, y[:2], sent[:2])
        rotation, whole = 0.3 + 0.1 * np.arange(2), np.ones(4, np.float32)
        if lost is not None:
            # Some samples of the training, or of the header, were blanked.
            whole[lost] = 0.5
            y[lost] *= 0.5
        block.content.whole[:4] = whole
        y[2:] *= np.exp(1j * rotation)[:, None]
        kernels.learn(
            in_tones(y, grid), in_tones(sent, grid), 2, rotation[-1], 0.1,
            tones(grid).content, block.content, new_scratch(grid).content,
        )  # fmt: skip
        learned = training.learn(y, sent, 2, rotation, before, grid, None, whole)
        assert_same(block.content, learned, grid)


@every_grid
def test_a_channel_that_moves_is_followed_alike(grid):
    """Ten corrections: first noise, then a step, then noise again, by fewer and fewer symbols."""
    draws, scratch = rng(), new_scratch(grid).content
    y, sent, _ = trained(draws, grid, 0.02)
    block, channel = both_estimates(grid, y, sent)
    phase = Kalman((0.0, 0.0), 0.0, 0.01)
    phase.predict()
    block.content.tracking[PHASE] = state_of(phase)
    for number in range(10):
        error = noise(draws, grid.n_used, 0.005) + (0.3 if number == 4 else 0)
        moved = in_tones(error[None], grid)[0]
        table, n = tones(grid).content, max(1, 8 - number)
        kernels.follow(moved, 0.005, n, table, block.content, scratch)
        smoothing.follow(error, 0.005, n, phase, channel, grid)
        assert block.content.tracking[PHASE] == pytest.approx(state_of(phase), rel=1e-3, abs=1e-6)
        assert_same(block.content, channel, grid)
        _move_on(table, block.content)
        smoothing.move_on(channel, grid)
        assert_same(block.content, channel, grid)
        if number == 6:
            _doubt_more(0.1, table, block.content)
            smoothing.doubt_more(0.1, channel, grid)
            assert_same(block.content, channel, grid)
    assert channel.drift > 0
    turns = block.content.figures[[TURNS, N_FOLLOWED]]
    assert turns == pytest.approx([channel.turns, channel.n_followed], rel=1e-3, abs=1e-6)
    assert 0 < channel.doubt < 0.1


@njit
def _move_on(table, channel):
    kernels.move_on(table, channel)


@njit
def _doubt_more(excess, table, channel):
    kernels.doubt_more(excess, table, channel)


@njit
def _predict(state):
    kernels.predict(state)


@njit
def _correct(turned_by, power, subcarriers, no, channel):
    return kernels.correct(
        turned_by, power, subcarriers, no, channel.figures, channel.missed, channel.tracking
    )


def state_of(kalman):
    """Value, rate, their variances and covariance, in the kernel's order."""
    return [kalman.value, kalman.rate, *kalman.covariance]


@every_grid
@pytest.mark.parametrize("clock_error", [None, 1.7e-5])
def test_pilots_are_tracked_alike(grid, clock_error):
    """With a rotation, a slope, a disturbed symbol, one without power, and a step of gain.

    In the end, pilots disagree alike in each symbol: the channel has moved.
    """
    draws = rng()
    block, channel = both_estimates(grid, *trained(draws, grid, 0.02)[:2])
    told = clock_error is not None
    # The kernel's own channel, so that nothing else differs.
    channel.no, channel.gain = block.content.no, block.content.gain
    channel.doubt = block.content.figures[DOUBT]
    kernels.start_tracking(tones(grid).content, block.content, clock_error or 0.0, told)
    ours, other = block.content.tracking, tracking.Tracking(grid, channel, clock_error)
    subcarriers = grid.used[grid.pilots_at]
    drowned, moved, weaker = [], [], []
    for number in range(40):
        _predict(ours)
        other.predict()
        angle = 0.02 * number + 1e-3 * number * subcarriers / grid.n_fft
        angle = angle - ours[PHASE, 0] - ours[SLOPE, 0] * subcarriers
        weight = draws.uniform(0.2, 2, len(subcarriers))
        came = weight * np.exp(1j * angle) + noise(draws, len(subcarriers), 0.02)
        came = came * (number != 7) + noise(draws, len(subcarriers), 3.0) * (number == 20)
        came = came * (0.5 if number == 27 else 1)
        if number > 33:
            came[0], weight[0] = -came[0], 1.0
        came = came.astype(np.complex128)
        shown = _correct(came, weight, subcarriers, channel.noise, block.content)
        assert other.correct_by(came, weight, subcarriers, channel, channel.noise) == pytest.approx(
            shown
        )
        no, movement, amplitude, _ = shown
        drowned += [number] * (no > 6 * channel.no)
        moved += [number] * (movement > 0.1)
        weaker += [number] * (amplitude < 0.6)
        assert block.content.figures[SPREAD] == pytest.approx(channel.spread)
        assert state_of(other.phase) == pytest.approx(ours[PHASE], rel=1e-6, abs=1e-12)
        assert state_of(other.slope) == pytest.approx(ours[SLOPE], rel=1e-6, abs=1e-15)
    assert [number for number in drowned if number < 34] == [20]
    assert weaker[0] == 27
    assert moved[0] >= 34
    compute.slip(2, tones(grid), block)
    other.slip(2)
    assert other.slope.value == pytest.approx(ours[SLOPE, 0])


def equalised(grid, modulation, n, lean, no, whole=1):
    """(the kernel's LLRs, points, channel; the reference's LLRs, points, equaliser).

    The `n` symbols rotate, with a growing slope, which reaches `lean` radians per subcarrier. Only
    a share of each is `whole`.
    """
    draws, n_bits = rng(modulation.bits), grid.n_data * modulation.bits
    block, channel = both_estimates(grid, *trained(draws, grid, no)[:2])
    coded = draws.integers(0, 2, n * n_bits, np.uint8)
    # Equal to the last bit: subcarriers in a fade would show a difference.
    channel.h, channel.no, channel.gain = (
        gains_of(block.content, grid),
        *block.content.figures[:2],
    )
    channel.unknown, channel.power = block.content.unknown.copy(), block.content.power.copy()
    channel.doubt = block.content.figures[DOUBT]
    y = mapping.to_subcarriers(coded, modulation, grid, 2) * channel.h
    angle = 0.01 * np.arange(n)[:, None] + lean / n * np.arange(n)[:, None] * grid.used
    y = y * np.exp(1j * angle)
    y[:, grid.data_at] += noise(draws, n * grid.n_data, no).reshape(n, -1)
    whole = np.ones(n, np.float32) * np.float32(whole)
    y = (y * whole[:, None]).astype(np.complex64)
    block.content.whole[:n] = whole
    kernels.start_tracking(tones(grid).content, block.content, 0.0, False)
    follows = tracking.Tracking(grid, channel, None)
    if not lean:
        # The kernel may let the slope lag.
        block.content.tracking[SLOPE, 2:] = 0
        follows.slope = tracking.Kalman(tracking.SLOPE_NOISE, 0.0, 0.0)
    llr, points = np.empty(n * n_bits, np.int16), np.empty((n, grid.n_data), np.complex64)
    kernels.equalise(
        in_tones(y, grid), n, 2, tones(grid).content, axes(modulation, grid).content,
        block.content, new_scratch(grid).content, points, llr, 0,
    )  # fmt: skip
    equaliser = reference.equaliser.Equaliser(grid, channel, follows)
    made, trust = [], []
    for i, each in enumerate(y):
        made.append(equaliser.equalise(each[None], 2 + i, modulation, None, whole[i : i + 1]))
        trust += equaliser.trust
    assert trust == pytest.approx(block.content.trust[:n].tolist(), rel=1e-3)
    other = np.concatenate([each for each, _ in made]), np.concatenate([each for _, each in made])
    return (llr, points, block.content), (*other, equaliser)


@pytest.mark.parametrize(
    ("modulation", "grid"), [*zip(Modulation, cycle(GRIDS.values()))], ids=Modulation.__members__
)
@pytest.mark.parametrize("noise_share", [0.3, 1e-3])
def test_symbols_are_equalised_alike(grid, modulation, noise_share):
    """A block of symbols, and the channel that both have learned from it."""
    no = noise_share / modulation.bits**2
    ours, other = equalised(grid, modulation, BLOCK, 0.0, no)
    # Near a step of the quantiser, single precision matters.
    difference = np.abs(ours[0].astype(int) - other[0])
    assert difference.max() <= 1
    assert np.mean(difference > 0) < 0.01
    assert ours[1] == pytest.approx(other[1], abs=1e-3 * np.abs(other[1]).max())
    assert_same(ours[2], other[2].channel, grid)
    assert ours[2].tracking[PHASE, 0] == pytest.approx(other[2].tracking.phase.value, abs=1e-4)


@every_grid
def test_symbols_of_which_samples_were_blanked_are_equalised_alike(grid):
    whole = np.ones(BLOCK)
    whole[[1, 4]] = 0.7, 0.2
    ours, other = equalised(grid, Modulation.QPSK, BLOCK, 0.0, 0.01, whole)
    assert np.abs(ours[0].astype(int) - other[0]).max() <= 1
    assert ours[1] == pytest.approx(other[1], abs=1e-3 * np.abs(other[1]).max())
    assert_same(ours[2], other[2].channel, grid)
    trust = ours[2].trust[:BLOCK]
    assert np.all((trust < 0.1) == (whole < 1))


@every_grid
def test_symbols_that_lean_are_equalised_alike(grid):
    """Unlike the reference, the kernel lets the slope lag by 0.01 rad at the outer subcarriers."""
    # Not for so long that one of them finds the channel still, and the other does not yet.
    ours, other = equalised(grid, Modulation.QAM16, 2 * BLOCK, 0.3 / grid.n_fft, 1e-3)
    assert abs(ours[2].figures[SLOPE_USED]) > 0
    # What the slope lags behind, the gains learn.
    assert np.abs(ours[1] - other[1]).max() < 0.015 * np.abs(other[1]).max()


@every_grid
def test_a_carrier_sent_as_1_comes_back_as_1(grid):
    """The control of the reference: its FFT inverts its inverse FFT, with the pilots' signs."""
    coded = rng().integers(0, 2, 5 * grid.n_data * 4, np.uint8)
    sent = mapping.to_subcarriers(coded, Modulation.QAM16, grid, 9)
    samples = ofdm.to_samples(sent, grid)
    assert np.mean(np.abs(samples) ** 2) == pytest.approx(1, abs=0.1)
    starts = grid.n_cp + grid.n_symbol * np.arange(5)
    assert ofdm.to_subcarriers(samples, starts, 0.0, 0j, grid) == pytest.approx(sent, abs=1e-12)
    pilots = sent[:, grid.pilots_at] * grid.pilot_values
    assert np.array_equal(pilots.real, np.repeat(polarity(5, 9)[:, None], pilots.shape[1], 1))
    # A window that begins within the prefix sees each subcarrier rotated, and nothing else.
    early = ofdm.to_subcarriers(samples, starts - 3, 0.0, 0j, grid)
    lean = np.exp(-2j * np.pi * 3 * grid.used / OFDM_64_16.n_fft * 64 / grid.n_fft)
    assert early == pytest.approx(sent * lean, abs=1e-12)


def test_a_channel_has_noise_however_strong_it_is():
    assert reference.channel.Channel(np.ones(52), 1e-9, 2.0).noise == 2e-4
    assert reference.channel.Channel(np.ones(52), 0.1, 2.0).noise == 0.1
