"""Compares equaliser and demapper with max-log LLRs computed from the constellation itself."""

import numpy as np
import pytest

from phy import OFDM_64_16, Modulation, points
from phy.kernels import equalise, start_tracking
from phy.reference import channel as reference_channel
from phy.testing import (
    DUE,
    GAIN,
    NO,
    SCALED,
    axes,
    convolutional,
    in_planes,
    mapping,
    new_channel,
    new_scratch,
    order,
    polarity,
    to_tones,
    tones,
)
from tests.laws import one_in

SEED = 17
GRID = OFDM_64_16
BLOCK = reference_channel.LONGEST
MAX_LLR = convolutional.MAX_LLR
N_SYMBOLS = BLOCK  # After so many, the channel is corrected by what was decided.
SCALE = 8  # LLRs are in eighths

every_modulation = pytest.mark.parametrize("modulation", Modulation)


def channel_of(h, no):
    """A perfectly known channel: gains of the subcarriers in use, noise power."""
    block = new_channel(GRID)
    channel = block.content
    channel.h[:, : GRID.n_used] = h[GRID.tones].real, h[GRID.tones].imag
    channel.centre[0] = 1
    channel.figures[[NO, GAIN]] = no, np.mean(np.abs(h) ** 2)
    channel.power[:] = channel.gain
    channel.figures[[DUE, SCALED]] = BLOCK, 1
    start_tracking(tones(GRID).content, channel, 0.0, False)
    return block


def demap(modulation, bins, channel, first_symbol=2):
    """(LLRs, points)."""
    llr = np.empty(len(bins) * GRID.n_data * modulation.bits, np.int16)
    equalised = np.empty((len(bins), GRID.n_data), np.complex64)
    y = in_planes(bins[:, GRID.bins[GRID.tones]])
    how = tones(GRID).content, axes(modulation, GRID).content
    equalise(
        y, len(y), first_symbol, *how, channel.content, new_scratch(GRID).content, equalised, llr, 0
    )
    return llr, equalised


def flat():
    return np.full(GRID.n_used, 0.7 - 0.4j)


def selective(rng):
    """Gains of subcarriers between a fade of 30 dB and a gain of 6 dB."""
    gain = 10 ** (rng.uniform(-30, 6, GRID.n_used) / 20)
    return gain * np.exp(2j * np.pi * rng.random(GRID.n_used))


def with_pilots(data, h, first_symbol=2):
    """Bins of received data subcarriers `[n, 48]` and undisturbed pilots."""
    n = len(data)
    used = np.zeros((n, GRID.n_used), np.complex128)
    used[:, GRID.data_at] = data
    pilots = polarity(n, first_symbol)[:, None] * GRID.pilot_values
    used[:, GRID.pilots_at] = h[GRID.pilots_at] * pilots
    bins = np.zeros((n, GRID.n_fft), np.complex64)
    bins[:, GRID.bins] = used
    return bins


def bins_of(coded, modulation, first_symbol):
    """Symbols as sent `[n, 64]`."""
    samples = mapping(modulation, GRID).to_samples(coded, first_symbol, np.inf)
    starts = np.arange(GRID.n_cp, len(samples), GRID.n_symbol)
    y = to_tones(samples, starts, 0.0, 0j, GRID)[:, :, : GRID.n_used]
    bins = np.zeros((len(y), GRID.n_fft), np.complex64)
    bins[:, GRID.bins[GRID.tones]] = y[:, 0] + 1j * y[:, 1]
    return bins


def exact_llrs(data, h, no, modulation):
    """Max-log by trying every point, converted to the code's order `[n · 48 · bits]`."""
    bits = modulation.bits
    expected = h[GRID.data_at][:, None] * points(modulation)
    distance = np.abs(data[..., None] - expected) ** 2
    number = np.arange(2**bits)
    llr = np.empty((*data.shape, bits))
    for b in range(bits):
        one = (number >> (bits - 1 - b) & 1).astype(bool)
        llr[..., b] = distance[..., one].min(-1) - distance[..., ~one].min(-1)
    sent = llr.reshape(len(data), -1) / no
    return sent[:, order(48 * bits, bits)].reshape(-1)


@every_modulation
@pytest.mark.parametrize("no", [1.0, 0.05, 0.001])
@pytest.mark.parametrize("kind", ["flat", "selective"])
def test_llrs_are_max_log_within_their_quantisation(modulation, no, kind):
    rng = np.random.default_rng(SEED)
    h = flat() if kind == "flat" else selective(rng)
    at = rng.integers(0, 2**modulation.bits, (N_SYMBOLS, 48))
    noise = rng.standard_normal((N_SYMBOLS, 48, 2)) @ [1, 1j] * 0.4
    # As complex64, because near the quantiser's steps single precision matters.
    data = (h[GRID.data_at] * (points(modulation)[at] + noise)).astype(np.complex64)
    channel = channel_of(h, no)
    llr, _ = demap(modulation, with_pilots(data, h), channel)
    wanted = np.clip(SCALE * exact_llrs(data, h, no, modulation), -MAX_LLR, MAX_LLR)
    assert llr == pytest.approx(wanted, abs=1.01)
    assert np.abs(llr).max() <= MAX_LLR
    assert llr.std() > 2


@every_modulation
def test_clean_symbols_give_back_their_bits(modulation):
    rng = np.random.default_rng(SEED)
    coded = rng.integers(0, 2, N_SYMBOLS * 48 * modulation.bits, np.uint8)
    h = selective(rng)
    bins = bins_of(coded, modulation, 5)
    bins[:, GRID.bins] *= h
    channel = channel_of(h, 1e-4)
    llr, equalised = demap(modulation, bins, channel, 5)
    # On a subcarrier in a deep fade, the finest points carry no information.
    assert np.count_nonzero(llr) > 0.95 * len(llr)
    assert np.array_equal(llr[llr != 0] < 0, coded[llr != 0])
    nearest = np.abs(equalised[..., None] - points(modulation)).min(-1)
    assert nearest.max() < 1e-4


@every_modulation
def test_symbols_one_by_one_are_the_same_as_together(modulation):
    rng = np.random.default_rng(SEED)
    h = selective(rng)
    n = 3 * BLOCK + 1
    bins = with_pilots(rng.standard_normal((n, 48)) * h[GRID.data_at], h)
    bins[:, GRID.bins] *= np.exp(0.05j * rng.standard_normal((n, 1)))
    together, _ = demap(modulation, bins, channel_of(h, 0.01))
    channel = channel_of(h, 0.01)
    one_by_one = [demap(modulation, bins[i : i + 1], channel, 2 + i)[0] for i in range(len(bins))]
    assert np.array_equal(together, np.concatenate(one_by_one))


def turned_symbols(n, phase, slope):
    """QPSK points, and bins with a rotation of phase + slope · subcarrier.

    `phase` and `slope` are in radians `[n]`.
    """
    rng = np.random.default_rng(SEED)
    sent = points(Modulation.QPSK)[rng.integers(0, 4, (n, 48))]
    bins = with_pilots(sent, np.ones(GRID.n_used))
    angle = phase[:, None] + slope[:, None] * GRID.used
    bins[:, GRID.bins] *= np.exp(1j * angle)
    return sent, bins.astype(np.complex64)


def error_after_tracking(n, phase, slope):
    """RMS errors of the equalised points by symbol `[n]`."""
    channel = channel_of(np.ones(GRID.n_used), 0.01)
    sent, bins = turned_symbols(n, phase, slope)
    _, equalised = demap(Modulation.QPSK, bins, channel)
    return np.sqrt(np.mean(np.abs(equalised - sent) ** 2, axis=1))


def test_a_rest_of_carrier_offset_is_followed():
    """Half a turn in a hundred symbols."""
    turn = np.pi / 100 * np.arange(200)
    error = error_after_tracking(200, turn, np.zeros(200))
    assert error[50:].max() < 0.02


def test_a_sampling_clock_40_ppm_off_is_followed():
    """Its slope reaches several turns over the band."""
    slope = 2 * np.pi * 80 / 64 * 40e-6 * np.arange(1000)
    error = error_after_tracking(1000, np.zeros(1000), slope)
    assert slope[-1] * 52 > 2 * np.pi
    assert error[100:].max() < 0.02


def test_a_carrier_that_does_not_arrive_tells_nothing():
    h = np.ones(GRID.n_used, np.complex128)
    h[GRID.data_at[7]] = 0
    channel = channel_of(h, 0.1)
    llr, equalised = demap(Modulation.QAM64, with_pilots(np.ones((1, 48)), h), channel)
    as_sent = np.empty_like(llr)
    as_sent[order(288, 6)] = llr
    tells = as_sent.reshape(48, 6).any(axis=1)
    assert list(np.flatnonzero(~tells)) == [7]
    assert equalised[0, 7] == 0


def faded_symbols(modulation, h, no, rng):
    """(coded bits, bins) of symbols through gains `h` `[n, n_used]` and noise."""
    n = len(h)
    coded = rng.integers(0, 2, n * GRID.n_data * modulation.bits, np.uint8)
    bins = bins_of(coded, modulation, 2)
    bins[:, GRID.bins] *= h
    noise = rng.standard_normal((n, GRID.n_fft, 2)) @ [1, 1j] * np.sqrt(no / 2)
    return coded, (bins + noise).astype(np.complex64)


@pytest.mark.slow
@pytest.mark.parametrize("modulation", one_in(5, reversed(Modulation)))
def test_a_channel_that_fades_is_followed(modulation):
    """Echoes rotate against each other: the band moves through its fades, as at 40 Hz and 5 Msps.

    The densest points tolerate a quarter of that: they lose track in the deepest fades.
    """
    rng = np.random.default_rng(SEED)
    n, no = 6000 if modulation is Modulation.QAM256 else 1500, 1e-4
    turn = 2 * np.pi * np.arange(n)[:, None] / n
    h = 1 + 0.5 * np.exp(1j * (turn + 2 * np.pi * 3 * GRID.used / GRID.n_fft))
    coded, bins = faded_symbols(modulation, h, no, rng)
    llr, _ = demap(modulation, bins, channel_of(h[0], no))
    assert np.mean((llr < 0) != coded) < 0.01
    # The control: with the first symbols' channel only, as if it were constant.
    stale = [demap(modulation, bins[i : i + 1], channel_of(h[0], no), 2 + i)[0] for i in range(n)]
    wrong = np.mean((np.concatenate(stale) < 0) != coded)
    assert wrong > 0.05 or modulation is Modulation.BPSK


def error_of(channel, h):
    """Mean square error, apart from phase and slope, which the pilots track."""
    subcarriers = GRID.used[GRID.tones]
    h_hat = (channel.content.h[0] + 1j * channel.content.h[1])[: GRID.n_used]
    leaning = h_hat * np.exp(1j * np.linspace(-0.05, 0.05, 101)[:, None] * subcarriers)
    match = np.abs(leaning @ h[GRID.tones].conj()).max()
    power = np.sum(np.abs(h_hat) ** 2) + np.sum(np.abs(h) ** 2)
    return (power - 2 * match) / len(subcarriers)


@pytest.mark.parametrize(
    ("modulation", "no"), [(Modulation.BPSK, 1.2), (Modulation.QPSK, 0.6), (Modulation.QAM16, 0.17)]
)
def test_a_channel_that_stands_still_becomes_known_better(modulation, no):
    """Where the code of rate 1/2 just works, and at least every tenth bit is decided wrongly."""
    rng = np.random.default_rng(SEED)
    h = flat() / abs(flat()[0])
    _, bins = faded_symbols(modulation, np.repeat(h[None, :], 200, axis=0), no, rng)
    noise = rng.standard_normal((GRID.n_used, 2)) @ [1, 1j]
    channel = channel_of(h + noise * np.sqrt(no / 8), no)
    channel.content.unknown[0] = no / 4
    before = error_of(channel, h)
    demap(modulation, bins, channel)
    assert error_of(channel, h) < before / 2


def test_a_symbol_drowned_by_another_sender_tells_little():
    rng = np.random.default_rng(SEED)
    _, bins = faded_symbols(Modulation.QPSK, np.ones((6, GRID.n_used)), 0.01, rng)
    bins[3] += (rng.standard_normal((GRID.n_fft, 2)) @ [1, 1j]) * 2
    llr, _ = demap(Modulation.QPSK, bins, channel_of(np.ones(GRID.n_used), 0.01))
    certainty = np.abs(llr.reshape(6, -1)).mean(axis=1)
    assert certainty[3] < 0.05 * np.delete(certainty, 3).min()
