"""The transmitter's output: peaks, edges, spectrum, and a preamble that may be stronger."""

import numpy as np
import pytest
from scipy.signal import resample_poly

from phy import GRIDS, MCS_TABLE, OFDM_64_16, BurstOver, Receiver, Transmitter, points
from phy.testing import preamble
from tests.phy.signals import heard, noisy, payloads, silence, turned

SEED = 67

every_mcs = pytest.mark.parametrize("mcs", MCS_TABLE, ids=lambda mcs: mcs.name)

# IEEE 802.11-2020, 17.3.9.3: offset relative to the channel's width, dB below the top.
MASK = ((0.45, 0.0), (0.55, -20.0), (1.0, -28.0), (1.5, -40.0))


def a_burst(mcs, n_pdus=20, **settings):
    rng = np.random.default_rng(SEED)
    return Transmitter(**settings).modulate(payloads(rng, n_pdus, 300), mcs)


@every_mcs
@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
def test_no_sample_is_beyond_the_peak_and_the_mean_is_1(mcs, grid):
    burst = a_burst(mcs.index, grid=grid)
    most = max(mcs.peak_db, MCS_TABLE[0].peak_db)
    assert np.abs(burst).max() <= 10 ** (most / 20) * (1 + 1e-5)
    # Peaks are clipped, which costs a few hundredths of a dB.
    assert np.mean(np.abs(burst[preamble.length(grid) :]) ** 2) == pytest.approx(1, abs=0.02)


@every_mcs
def test_clipped_peaks_take_nothing_of_a_symbols_amplitude(mcs):
    """Else its gain would be that of a channel that fades for one symbol."""
    burst = a_burst(mcs.index, 60)[preamble.length() :]
    # The first two symbols are the header; the last one ends softly.
    n_fft = OFDM_64_16.n_fft
    inner = burst.reshape(-1, OFDM_64_16.n_symbol)[2:-1, -n_fft:]
    y = np.fft.fft(inner)[:, OFDM_64_16.bins][:, OFDM_64_16.data_at] * np.sqrt(52) / n_fft
    known = points(mcs.modulation)
    sent = known[np.argmin(np.abs(y[:, :, None] - known), axis=2)]
    gain = np.sum(y * sent.conj(), axis=1).real / np.sum(np.abs(sent) ** 2, axis=1)
    assert np.std(gain) < 0.004
    assert np.abs(gain - 1).max() < 0.025


def test_bursts_begin_and_end_without_a_step():
    burst = np.abs(a_burst(1))
    assert burst[0] < 0.1 * np.abs(preamble.preamble()[0])
    assert burst[-1] < 0.2


@every_mcs
def test_the_spectrum_fits_the_mask_at_four_times_the_rate(mcs):
    """The mask of 802.11a, scaled to the rate; it is linear between its corners."""
    x = resample_poly(a_burst(mcs.index), 4, 1, window=("kaiser", 8.0))
    size = 512
    blocks = x[: len(x) // size * size].reshape(-1, size) * np.hanning(size)
    power = np.fft.fftshift(np.mean(np.abs(np.fft.fft(blocks)) ** 2, axis=0))
    offset = np.abs(np.fft.fftshift(np.fft.fftfreq(size)) * 4)
    at, limit = np.array(MASK).T
    allowed = np.interp(offset, at, limit)
    level = 10 * np.log10(power / np.quantile(power[offset < 0.35], 0.9))
    assert (level - allowed).max() < 1.5


@every_mcs
def test_the_carrier_at_dc_is_empty(mcs):
    burst = a_burst(mcs.index)
    bins = np.fft.fft(burst[preamble.length() :].reshape(-1, 80)[:, 16:])
    power = np.mean(np.abs(bins) ** 2, axis=0)
    assert power[0] < 1e-2 * power[OFDM_64_16.bins].mean()


@pytest.mark.parametrize("boost_db", [0.0, 1.5, 3.0])
@every_mcs
def test_a_stronger_preamble_changes_nothing_else(mcs, boost_db):
    rng = np.random.default_rng(SEED)
    pdus = payloads(rng, 3, 200)
    burst = Transmitter(preamble_boost_db=boost_db).modulate(pdus, mcs.index)
    plain = Transmitter().modulate(pdus, mcs.index)
    n = preamble.length()
    assert np.array_equal(burst[n:], plain[n:])
    assert burst[:n] == pytest.approx(10 ** (boost_db / 20) * plain[:n], rel=1e-5)
    receiver = Receiver()
    events = receiver.push(noisy(rng, np.concatenate((silence(500), burst)), 32))
    events += receiver.flush()
    assert heard(events) == pdus
    # The payload's level decides the choice of an MCS.
    assert events[0].burst.snr_db == pytest.approx(32, abs=2)


def test_a_stronger_preamble_is_found_farther_away():
    n = 150
    found = {}
    for boost_db in (0.0, 3.0):
        rng = np.random.default_rng(SEED)
        transmitter, receiver = Transmitter(preamble_boost_db=boost_db), Receiver()
        events = []
        for _ in range(n):
            burst = turned(transmitter.modulate([rng.bytes(20)], 0), rng.uniform(-0.02, 0.02))
            events += receiver.push(noisy(rng, np.concatenate((silence(400), burst)), -5.5))
        events += receiver.flush()
        found[boost_db] = receiver.counters["preambles"]
        assert sum(isinstance(each, BurstOver) for each in events) <= found[boost_db]
    assert found[3.0] > 0.9 * n > 1.5 * found[0.0]


@pytest.mark.parametrize("boost_db", [-0.1, 3.1, float("nan")])
def test_a_boost_that_cannot_be_names_what_can(boost_db):
    with pytest.raises(ValueError, match=r"preamble boost: got .* allowed: 0 to 3"):
        Transmitter(preamble_boost_db=boost_db)
