"""Equaliser and demapper against max-log LLRs computed from the constellation itself."""

import numpy as np
import pytest

from phy import OFDM_64_16, Modulation, points
from phy.convolutional import MAX_LLR
from phy.demodulation import Demodulator, new_tracking
from phy.estimation import ChannelEstimate
from phy.interleaver import order
from phy.mapping import mapping
from phy.sequences import polarity

SEED = 17
GRID = OFDM_64_16
N_SYMBOLS = 20
SCALE = 8  # LLRs are in eighths

every_modulation = pytest.mark.parametrize("modulation", Modulation)


def channel_of(h, no):
    return ChannelEstimate(h.astype(np.complex64), no, float(np.mean(np.abs(h) ** 2)))


def flat():
    return np.full(GRID.n_used, 0.7 - 0.4j)


def selective(rng):
    """Carriers between a fade of 30 dB and a gain of 6."""
    gain = 10 ** (rng.uniform(-30, 6, GRID.n_used) / 20)
    return gain * np.exp(2j * np.pi * rng.random(GRID.n_used))


def with_pilots(data, h, first_symbol=2):
    """Bins of received data carriers `[n, 48]` and undisturbed pilots."""
    n = len(data)
    used = np.zeros((n, GRID.n_used), np.complex128)
    used[:, GRID.data_at] = data
    pilots = polarity(n, first_symbol)[:, None] * GRID.pilot_values
    used[:, GRID.pilots_at] = h[GRID.pilots_at] * pilots
    bins = np.zeros((n, GRID.n_fft), np.complex64)
    bins[:, GRID.bins] = used
    return bins


def exact_llrs(data, h, no, modulation):
    """Max-log by trying every point, then back into the code's order `[n · 48 · bits]`."""
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
    # As complex64, for near the steps of the quantiser single precision decides.
    data = (h[GRID.data_at] * (points(modulation)[at] + noise)).astype(np.complex64)
    channel = channel_of(h, no)
    llr, _ = Demodulator(modulation, GRID).demap(
        with_pilots(data, h), channel, new_tracking(channel, GRID), 2
    )
    wanted = np.clip(SCALE * exact_llrs(data, h, no, modulation), -MAX_LLR, MAX_LLR)
    assert llr == pytest.approx(wanted, abs=1.01)
    assert np.abs(llr).max() <= MAX_LLR
    assert llr.std() > 2


@every_modulation
def test_clean_symbols_give_back_their_bits(modulation):
    rng = np.random.default_rng(SEED)
    coded = rng.integers(0, 2, N_SYMBOLS * 48 * modulation.bits, np.uint8)
    h = selective(rng)
    bins = mapping(modulation, GRID).to_spectrum(coded, 5)
    bins[:, GRID.bins] *= h
    channel = channel_of(h, 0.001)
    llr, equalised = Demodulator(modulation, GRID).demap(
        bins, channel, new_tracking(channel, GRID), 5
    )
    # On a carrier that hardly arrives, the finest points tell nothing.
    assert np.count_nonzero(llr) > 0.95 * len(llr)
    assert np.array_equal(llr[llr != 0] < 0, coded[llr != 0])
    nearest = np.abs(equalised[..., None] - points(modulation)).min(-1)
    assert nearest.max() < 1e-4


@every_modulation
def test_symbols_one_by_one_are_the_same_as_together(modulation):
    rng = np.random.default_rng(SEED)
    h = selective(rng)
    bins = with_pilots(rng.standard_normal((N_SYMBOLS, 48)) * h[GRID.data_at], h)
    bins[:, GRID.bins] *= np.exp(0.05j * rng.standard_normal((N_SYMBOLS, 1)))
    channel = channel_of(h, 0.01)
    demodulator = Demodulator(modulation, GRID)
    together, _ = demodulator.demap(bins, channel, new_tracking(channel, GRID), 2)
    tracking = new_tracking(channel, GRID)
    one_by_one = [
        demodulator.demap(bins[i : i + 1], channel, tracking, 2 + i)[0] for i in range(N_SYMBOLS)
    ]
    assert np.array_equal(together, np.concatenate(one_by_one))


def turned_symbols(n, phase, slope):
    """QPSK points sent, and bins whose carriers turn by phase + slope · carrier, radians `[n]`."""
    rng = np.random.default_rng(SEED)
    sent = points(Modulation.QPSK)[rng.integers(0, 4, (n, 48))]
    bins = with_pilots(sent, np.ones(GRID.n_used))
    angle = phase[:, None] + slope[:, None] * GRID.used
    bins[:, GRID.bins] *= np.exp(1j * angle)
    return sent, bins.astype(np.complex64)


def error_after_tracking(n, phase, slope):
    """Errors of the equalised points by symbol, rms `[n]`."""
    channel = channel_of(np.ones(GRID.n_used), 0.01)
    sent, bins = turned_symbols(n, phase, slope)
    _, equalised = Demodulator(Modulation.QPSK, GRID).demap(
        bins, channel, new_tracking(channel, GRID), 2
    )
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
    llr, equalised = Demodulator(Modulation.QAM64, GRID).demap(
        with_pilots(np.ones((1, 48)), h), channel, new_tracking(channel, GRID), 2
    )
    as_sent = np.empty_like(llr)
    as_sent[order(288, 6)] = llr
    tells = as_sent.reshape(48, 6).any(axis=1)
    assert list(np.flatnonzero(~tells)) == [7]
    assert equalised[0, 7] == 0
