"""Eight lanes: compares every operation with numpy, FFTs and the demapper with the reference."""

import numpy as np
import pytest
from numba import njit

from phy import GRIDS, Modulation, points
from phy.kernels import axis_llrs, expected_level, lanes
from phy.reference import demapper, ofdm
from phy.testing import N_LANES, to_tones
from tests.phy.signals import noise

SEED = 49


def rng():
    return np.random.default_rng(SEED)


@njit
def _operations(a, b, out):
    x, y = lanes.load(a, 0), lanes.load(b, 0)
    lanes.store(out, 0, x + y)
    lanes.store(out, 8, x - y)
    lanes.store(out, 16, x * y)
    lanes.store(out, 24, x / y)
    lanes.store(out, 32, -x)
    lanes.store(out, 40, lanes.magnitude(x))
    lanes.store(out, 48, lanes.with_sign(x, y))
    lanes.store(out, 56, lanes.least(x, y))
    lanes.store(out, 64, lanes.most(x, y))
    lanes.store(out, 72, lanes.first_halves(x, y))
    lanes.store(out, 80, lanes.second_halves(x, y))
    lanes.store(out, 88, lanes.splat(b[3]))
    lanes.store(out, 96, lanes.splat(lanes.total(x)))
    lanes.store(out, 104, lanes.root(lanes.magnitude(x)))


def test_every_operation_is_that_of_float32():
    a, b = rng().standard_normal((2, N_LANES)).astype(np.float32)
    a[0], b[1] = 0, np.inf
    out = np.empty((14, N_LANES), np.float32)
    _operations(a, b, out.reshape(-1))
    halves = [np.stack((a[at], b[at]), axis=1).reshape(-1) for at in (slice(4), slice(4, 8))]
    four = a[:4] + a[4:]
    total = (four[0] + four[2]) + (four[1] + four[3])
    expected = [
        a + b, a - b, a * b, a / b, -a, abs(a), np.copysign(a, b), np.minimum(a, b),
        np.maximum(a, b), *halves, np.full(8, b[3]), np.full(8, total), np.sqrt(abs(a)),
    ]  # fmt: skip
    assert out.tobytes() == np.array(expected, np.float32).tobytes()


@njit
def _whole(a, out):
    lanes.store_int16(out, 2, lanes.load(a, 1))


def test_whole_numbers_are_cut_towards_zero():
    a = np.array([9, 1.9, -1.9, 0.5, -0.5, 511, -511, 32000.5, -0.0], np.float32)
    out = np.full(12, 7, np.int16)
    _whole(a, out)
    assert list(out) == [7, 7, 1, -1, 0, 0, 511, -511, 32000, 0, 7, 7]


@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
def test_tones_are_those_of_the_references_fft(grid):
    x = noise(rng(), 5000)
    frequency, dc, at = 0.0173, 0.1 + 0.2j, 7
    for n in (1, 2, 7, 8, 9, 31):
        starts = np.sort(rng().integers(0, len(x) - grid.n_fft + 1, n))
        starts[-1] = len(x) - grid.n_fft
        expected = ofdm.to_subcarriers(x, starts, frequency, dc, grid, at)[:, grid.tones]
        y = to_tones(x, starts, frequency, dc, grid, at)
        assert y[:, 0, : grid.n_used] + 1j * y[:, 1, : grid.n_used] == pytest.approx(
            expected, abs=2e-6
        )


def test_a_window_is_the_same_alone_and_among_others():
    grid, x = GRIDS["64/16"], noise(rng(), 2000)
    starts = 80 * np.arange(20)
    together = to_tones(x, starts, 0.01, 0j, grid)
    for i, start in enumerate(starts):
        assert np.array_equal(to_tones(x, np.array([start]), 0.01, 0j, grid)[0], together[i])


@njit
def _llrs(level, weight, axis_bits, out):
    for d in range(0, level.size, N_LANES):
        axis_llrs(lanes.load(level, d), lanes.load(weight, d), axis_bits, out, d, level.size)


@njit
def _means(llr, axis_bits, n, mean, square):
    for d in range(0, n, N_LANES):
        m, s = expected_level(llr, axis_bits, d, n)
        lanes.store(mean, d, m)
        lanes.store(square, d, s)


@pytest.mark.parametrize("axis_bits", [1, 2, 3, 4])
def test_the_demapper_does_what_the_reference_says_bit_for_bit(axis_bits):
    draws, n = rng(), 800
    level = (draws.standard_normal(n) * 2**axis_bits).astype(np.float32)
    level[:4] = 0, -0.0, 1, -(2**axis_bits)
    weight = (10 ** draws.uniform(-3, 3, n)).astype(np.float32)
    llr = np.empty((axis_bits, n), np.float32)
    _llrs(level, weight, axis_bits, llr.reshape(-1))
    assert llr.tobytes() == demapper.axis_llrs(level, weight, axis_bits).tobytes()
    mean, square = np.empty((2, n), np.float32)
    _means(llr.reshape(-1), axis_bits, n, mean, square)
    plain_mean, plain_square = demapper.expected_levels(llr)
    assert mean.tobytes() == plain_mean.tobytes()
    assert square.tobytes() == plain_square.tobytes()


@pytest.mark.parametrize("modulation", Modulation)
def test_decisions_are_means_over_the_points(modulation):
    """Each point has the probability that its bits give."""
    axis_bits = modulation.axis_bits
    n = 1 << axis_bits
    llr = rng().integers(-60, 61, (axis_bits, 48)).astype(np.float32)
    mean, square = demapper.expected_levels(llr)
    bits = np.arange(n)[:, None] >> np.arange(axis_bits)[::-1] & 1
    of_one = 1 / (1 + np.exp(llr / 8.0))
    chance = np.prod(np.where(bits[..., None], of_one, 1 - of_one), axis=1)
    values = points(modulation)
    level = values.real if modulation is Modulation.BPSK else values.reshape(n, n)[:, 0].real
    level = level / modulation.unit
    assert mean == pytest.approx(level @ chance, abs=0.03 * n)
    assert square == pytest.approx(level**2 @ chance, abs=0.03 * n * n)
