"""Results of training: correlation, gains, their noise, and the decisions."""

import numpy as np
import pytest

from phy import GRIDS, OFDM_64_16, kernels, reference
from phy.reference import smoothing, timing, training
from phy.testing import compute, in_planes, new_channel, new_scratch, tones
from tests.phy.signals import noise

SEED = 48


def rng():
    return np.random.default_rng(SEED)


def gains(channel, n):
    return (channel.h[0] + 1j * channel.h[1])[:n]


def planes_of(x):
    return np.stack((x.real, x.imag)).astype(np.float32)


@pytest.mark.parametrize("n", [16, 64, 128])
def test_correlation_with_two_templates_in_a_row(n):
    """Templates longer than 64 samples add up as powers."""
    z, templates = noise(rng(), 2 * n + 8), noise(rng(), 3 * n).reshape(3, n)
    out = np.empty((3, 8), np.float32)
    kernels.correlate(planes_of(z), templates, out)
    assert out == pytest.approx(timing.strengths(z, templates, 8), rel=1e-4)


@pytest.mark.parametrize("frequency", [0.0, 0.0173, -0.49])
def test_samples_are_turned_back(frequency):
    x = noise(rng(), 679)
    out = np.empty((2, 700), np.float32)
    kernels.turn_back(x, 0.1 - 0.2j, frequency, out)
    wanted = reference.ofdm.turned_back(x, 0.1 - 0.2j, frequency)
    assert out[0, :679] + 1j * out[1, :679] == pytest.approx(wanted, abs=1e-5)


def test_least_squares_tells_gains_and_noise():
    """Some of the symbols were sent stronger."""
    draws = rng()
    sent = draws.choice([-1, 1, 1j], (4000, 4)).astype(np.complex64)
    amplitude = np.resize([1, 1.4], 4000).astype(np.float32)
    h = np.array([1, 2j, -0.5, 0.1 + 0.1j])
    y = noise(draws, 4000 * 4, 0.3).reshape(4000, 4) + amplitude[:, None] * h * sent
    found = np.empty((2, 8), np.float32)
    noise_power, power = kernels.least_squares(in_planes(y), amplitude, in_planes(sent), found)
    assert found[0, :4] + 1j * found[1, :4] == pytest.approx(h, abs=0.03)
    assert noise_power == pytest.approx(4 * 0.3, rel=0.03)
    assert power == pytest.approx(np.sum(np.abs(h) ** 2), rel=0.03)
    wanted, no = training.least_squares(y, sent, amplitude)
    assert found[0, :4] + 1j * found[1, :4] == pytest.approx(wanted, abs=1e-4)
    assert noise_power == pytest.approx(4 * no, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("boost", [0.7, 1.0, 1.41])
def test_a_header_tells_how_much_stronger_the_preamble_was(boost):
    """The channel is that of the header, estimated from all four symbols."""
    draws, grid = rng(), OFDM_64_16
    table, scratch = tones(grid).content, new_scratch(grid).content
    h = np.exp(-2j * np.pi * 3 * table.subcarriers / 64) * (1 + 0.3j)
    sent = draws.choice([-1, 1], (4, 52)).astype(np.complex64)
    amplitude = np.array([boost, boost, 1, 1], np.float32)
    y = noise(draws, 4 * 52, 0.01).reshape(4, 52) + amplitude[:, None] * h * sent
    channel, known = new_channel(grid).content, in_planes(sent)
    kernels.estimate(in_planes(y[:2]), np.ones(2, np.float32), known[:2], table, channel, scratch)
    assert gains(channel, 52) == pytest.approx(boost * h, abs=0.1)
    kernels.learn(in_planes(y), known, 2, 0.0, 0.0, table, channel, scratch)
    assert np.mean(np.abs(gains(channel, 52) - h) ** 2) < 0.1 * 0.01
    assert channel.no == pytest.approx(0.01, rel=0.3)


def smoothed(h, no, grid=OFDM_64_16):
    """(estimate, remaining variance) of gains in the order of tones, measured with noise `no`."""
    rough = h + noise(np.random.default_rng(SEED), len(h), no)
    channel = new_channel(grid).content
    channel.h[:] = in_planes(rough[None])[0]
    kernels.smooth(no, tones(grid).content, channel, new_scratch(grid).content)
    in_order = np.empty_like(rough)
    in_order[grid.tones] = rough
    other = reference.channel.Channel(in_order, no, 1.0)
    smoothing.smooth(in_order, no, other, grid)
    assert gains(channel, len(h)) == pytest.approx(other.h[grid.tones], abs=1e-4)
    return gains(channel, len(h)), channel.unknown


@pytest.mark.parametrize("delay", [0.0, 3.0, 3.4, -7.5])
@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
def test_of_one_path_hardly_any_noise_is_left(grid, delay):
    subcarriers = tones(grid).content.subcarriers
    h = 0.8 * np.exp(-2j * np.pi * delay * subcarriers / grid.n_fft)
    for no in (0.5, 0.01, 1e-4):
        error = np.mean(np.abs(smoothed(h, no, grid)[0] - h) ** 2)
        assert error < 0.2 * no


def test_of_many_echoes_no_more_is_lost_than_smoothing_is_worth():
    """However the gains vary, even unlike any channel, smoothing never does harm."""
    draws, subcarriers = rng(), tones(OFDM_64_16).content.subcarriers
    for echoes in (2, 8, 16, 60):
        taps = noise(draws, echoes)
        h = np.exp(-2j * np.pi * subcarriers[:, None] * np.arange(echoes) / 64) @ taps
        for no in (1.0, 0.01, 1e-4):
            power = np.mean(np.abs(h) ** 2)
            error = np.mean(np.abs(smoothed(h, no)[0] - h) ** 2)
            assert error < 1.5 * min(no, power)


def test_a_basis_is_orthonormal():
    for grid in GRIDS.values():
        basis = tones(grid).content.basis
        assert basis @ basis.T == pytest.approx(np.eye(len(basis)), abs=1e-5)


def test_the_likeliest_code_words_come_first():
    """Compared with every message of a short code."""
    n_bits, n_list = 8, 6
    messages = np.unpackbits(np.arange(256, dtype=np.uint8)[:, None], axis=1)
    padded = np.zeros((256, n_bits + 6), np.uint8)
    padded[:, :n_bits] = messages
    coded = np.empty((256, 2 * padded.shape[1]), np.uint8)
    compute.convolve(padded, coded)
    for seed in range(20):
        llr = np.random.default_rng(seed).integers(-99, 100, coded.shape[1]).astype(np.int16)
        score = (1 - 2 * coded.astype(int)) @ llr
        best = np.argsort(-score, kind="stable")[:n_list]
        out = np.empty((n_list, padded.shape[1]), np.uint8)
        compute.list_decode(llr, out)
        assert np.array_equal(reference.viterbi.decode(llr, n_list), out), seed
        found = np.packbits(out[:, :n_bits], axis=1)[:, 0]
        assert list(score[found]) == list(score[best]), seed
        assert len(set(found)) == n_list
