"""What training tells: correlation, gains, what is noise of them, and what was decided."""

import numpy as np
import pytest

from phy import OFDM_64_16, Modulation, points
from phy.estimation import new_channel, tones
from phy.kernels.acquisition import correlate
from phy.kernels.convolution import convolve
from phy.kernels.decisions import expected_levels
from phy.kernels.list_viterbi import list_decode
from phy.kernels.smoothing import mean_delay, smooth
from phy.kernels.training import estimate, learn, least_squares, spectrum, turn_back, wave
from phy.numerology import GRIDS
from tests.phy.signals import noise

SEED = 48


def rng():
    return np.random.default_rng(SEED)


def planes_of(x):
    return np.stack((x.real, x.imag)).astype(np.float32)


def test_correlation_with_two_templates_in_a_row():
    z, templates = noise(rng(), 2 * 16 + 8), noise(rng(), 3 * 16).reshape(3, 16)
    out = np.empty((3, 8), np.float32)
    correlate(planes_of(z), templates, out)
    wanted = [
        [np.abs(np.vdot(t, z[o : o + 16]) + np.vdot(t, z[o + 16 : o + 32])) ** 2 for o in range(8)]
        for t in templates
    ]
    assert out == pytest.approx(np.array(wanted), rel=1e-4)


@pytest.mark.parametrize("frequency", [0.0, 0.0173, -0.49])
def test_samples_are_turned_back(frequency):
    x = noise(rng(), 679)
    out = np.empty((2, 700), np.float32)
    turn_back(x, 0.1 - 0.2j, frequency, out)
    wanted = (x - (0.1 - 0.2j)) * np.exp(-2j * np.pi * frequency * np.arange(679))
    assert out[0, :679] + 1j * out[1, :679] == pytest.approx(wanted, abs=1e-5)


def test_a_spectrum_is_a_dft_of_its_window():
    x, grid = noise(rng(), 100), OFDM_64_16
    angle = 2 * np.pi * grid.used * np.arange(64)[:, None] / 64
    dft = np.stack((np.cos(angle), -np.sin(angle))).astype(np.float32)
    out = np.empty(52, np.complex64)
    spectrum(planes_of(x), 17, dft, out)
    assert out == pytest.approx(np.fft.fft(x[17:81])[grid.bins], abs=1e-4)


def test_a_wave_is_a_product():
    matrix, h = noise(rng(), 400).reshape(10, 40), noise(rng(), 40)
    out = np.empty(10, np.complex64)
    wave(matrix, h, out)
    assert out == pytest.approx(matrix @ h, abs=1e-4)


def test_least_squares_tells_gains_and_noise():
    """Of symbols of which some went out stronger."""
    draws = rng()
    used = np.array([1, 5, 6, 60])
    sent = draws.choice([-1, 1, 1j], (4000, 4)).astype(np.complex64)
    amplitude = np.resize([1, 1.4], 4000).astype(np.float32)
    h = np.array([1, 2j, -0.5, 0.1 + 0.1j])
    bins = noise(draws, 4000 * 64, 0.3).reshape(4000, 64)
    bins[:, used] += amplitude[:, None] * h * sent
    out = np.empty(4, np.complex64)
    no, power = least_squares(bins, amplitude, sent, used, out)
    assert out == pytest.approx(h, abs=0.03)
    assert no == pytest.approx(0.3, rel=0.03)
    assert power == pytest.approx(np.mean(np.abs(h) ** 2), rel=0.03)


@pytest.mark.parametrize("boost", [0.7, 1.0, 1.41])
def test_a_header_tells_how_much_stronger_the_preamble_was(boost):
    """The channel is that of the header, with all four symbols' help."""
    draws, grid = rng(), OFDM_64_16
    table = tones(grid)
    h = np.exp(-2j * np.pi * 3 * table.carriers / 64) * (1 + 0.3j)
    sent = draws.choice([-1, 1], (4, 52)).astype(np.complex64)
    bins = noise(draws, 4 * 64, 0.01).reshape(4, 64)
    amplitude = np.array([boost, boost, 1, 1], np.float32)
    bins[:, table.bins] += amplitude[:, None] * h * sent
    channel = new_channel(grid)
    estimate(bins[:2], np.ones(2, np.float32), sent[:2], table, channel)
    assert channel.h_hat == pytest.approx(boost * h, abs=0.1)
    learn(bins, sent, 2, 0.0, 0.0, table, channel)
    assert channel.h_hat == pytest.approx(h, abs=0.05)
    assert channel.no == pytest.approx(0.01, rel=0.3)


def smoothed(h, no, grid=OFDM_64_16):
    """(estimate, variance left) of gains in the order of tones, measured with noise `no`."""
    table = tones(grid)
    rough = (h + noise(np.random.default_rng(SEED), len(h), no)).astype(np.complex64)
    out = np.empty(len(h), np.complex64)
    unknown, power = np.zeros(len(table.ends) + 1), np.zeros(len(table.ends) + 1)
    delay = mean_delay(rough, table.neighbours)
    smooth(rough, no, delay, table.carriers, table.basis, table.ends, unknown, power, out)
    return out, unknown


@pytest.mark.parametrize("delay", [0.0, 3.0, 3.4, -7.5])
@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
def test_of_one_path_hardly_any_noise_is_left(grid, delay):
    carriers = tones(grid).carriers
    h = 0.8 * np.exp(-2j * np.pi * delay * carriers / grid.n_fft)
    for no in (0.5, 0.01, 1e-4):
        error = np.mean(np.abs(smoothed(h, no, grid)[0] - h) ** 2)
        assert error < 0.2 * no


def test_of_many_echoes_no_more_is_lost_than_smoothing_is_worth():
    """However the gains vary, even as no channel's do, it never does harm."""
    draws, carriers = rng(), tones(OFDM_64_16).carriers
    for echoes in (2, 8, 16, 60):
        taps = noise(draws, echoes)
        h = np.exp(-2j * np.pi * carriers[:, None] * np.arange(echoes) / 64) @ taps
        for no in (1.0, 0.01, 1e-4):
            power = np.mean(np.abs(h) ** 2)
            error = np.mean(np.abs(smoothed(h, no)[0] - h) ** 2)
            assert error < 1.5 * min(no, power)


def test_a_basis_is_orthonormal():
    for grid in GRIDS.values():
        basis = tones(grid).basis
        assert basis @ basis.T == pytest.approx(np.eye(len(basis)), abs=1e-5)


@pytest.mark.parametrize("modulation", Modulation)
def test_decisions_are_means_over_the_points(modulation):
    """With each point as likely as its bits say."""
    axis_bits = modulation.axis_bits
    n = 1 << axis_bits
    llr = rng().integers(-60, 61, (axis_bits, 50)).astype(np.int16)
    mean, square = np.empty(50, np.float32), np.empty(50, np.float32)
    expected_levels(llr.reshape(-1), axis_bits, 8.0, mean, square)
    bits = np.arange(n)[:, None] >> np.arange(axis_bits)[::-1] & 1
    of_one = 1 / (1 + np.exp(llr / 8.0))
    chance = np.prod(np.where(bits[..., None], of_one, 1 - of_one), axis=1)
    values = points(modulation)
    level = values.real if modulation is Modulation.BPSK else values.reshape(n, n)[:, 0].real
    level = level / modulation.unit
    assert mean == pytest.approx(level @ chance, abs=0.03 * n)
    assert square == pytest.approx(level**2 @ chance, abs=0.03 * n * n)


def test_the_likeliest_code_words_come_first():
    """Against every message of a short code."""
    n_bits, n_list = 8, 6
    messages = np.unpackbits(np.arange(256, dtype=np.uint8)[:, None], axis=1)
    padded = np.zeros((256, n_bits + 6), np.uint8)
    padded[:, :n_bits] = messages
    coded = np.empty((256, 2 * padded.shape[1]), np.uint8)
    convolve(padded, coded)
    for seed in range(20):
        llr = np.random.default_rng(seed).integers(-99, 100, coded.shape[1]).astype(np.int16)
        score = (1 - 2 * coded.astype(int)) @ llr
        best = np.argsort(-score, kind="stable")[:n_list]
        out = np.empty((n_list, padded.shape[1]), np.uint8)
        list_decode(llr, out)
        found = np.packbits(out[:, :n_bits], axis=1)[:, 0]
        assert list(score[found]) == list(score[best]), seed
        assert len(set(found)) == n_list
