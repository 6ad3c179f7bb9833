"""The channel has the requested properties, as measured."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import j0

from phy import PROFILES, FrontEnd, FrontEndParams, Path, PathParams
from phy.testing import FADING_BLOCK, N_TAPS, echo_filters, jakes, moving_filter, stretch
from tests.laws import law
from tests.phy.signals import noise, silence, turned

SEED = 43
RATE = 1e6


def rng():
    return np.random.default_rng(SEED)


def decibel(ratio):
    return 10 * np.log10(ratio)


def power_db(x):
    return decibel(np.mean(np.abs(x) ** 2))


def error_db(x, wanted):
    return decibel(np.sum(np.abs(x - wanted) ** 2) / np.sum(np.abs(wanted) ** 2))


def band_limited(t, band=26.5 / 64):
    """A signal of 40 tones within ±`band` cycles per sample, at arbitrary times."""
    draws = rng()
    frequency = draws.uniform(-band, band, 40)
    gain = draws.standard_normal(40) + 1j * draws.standard_normal(40)
    return np.exp(2j * np.pi * np.asarray(t)[..., None] * frequency) @ gain


def carry(x, **params):
    return Path(PathParams(rate_hz=RATE, **params), rng()).carry(x.astype(np.complex64))


@pytest.mark.parametrize("noise_dbfs", [-50, -6, 0])
def test_noise_has_the_power_asked_for_and_no_colour(noise_dbfs):
    x = FrontEnd(FrontEndParams(noise_dbfs=noise_dbfs), rng()).receive(silence(200_000))
    assert power_db(x) == pytest.approx(noise_dbfs, abs=0.05)
    assert decibel(np.var(x.real) / np.var(x.imag)) == pytest.approx(0, abs=0.05)
    assert abs(np.mean(x**2)) < 0.01 * np.mean(np.abs(x) ** 2)
    spectrum = np.mean(np.abs(np.fft.fft(x.reshape(-1, 64))) ** 2, axis=0)
    assert np.ptp(decibel(spectrum)) < 1


def test_a_front_end_of_no_faults_changes_nothing():
    x = noise(rng(), 1000)
    assert np.array_equal(FrontEnd(FrontEndParams(), rng()).receive(x.copy()), x)


def test_image_and_dc_have_the_strength_asked_for():
    x = turned(np.ones(4096), 0.125)
    y = FrontEnd(FrontEndParams(image_db=25, dc_dbfs=-30), rng()).receive(x)
    spectrum = decibel(np.abs(np.fft.fft(y) / 4096) ** 2 + 1e-15)
    assert spectrum[512] == pytest.approx(0, abs=0.01)
    assert spectrum[-512] == pytest.approx(-25, abs=0.05)
    assert spectrum[0] == pytest.approx(-30, abs=0.05)


@pytest.mark.parametrize("bits", [1, 4, 8, 12])
def test_a_converter_has_its_levels_and_clips(bits):
    step = 2.0 ** (1 - bits)
    x = np.linspace(-1.5, 1.5, 30_001)
    y = FrontEnd(FrontEndParams(bits=bits), rng()).receive((x - 1j * x).astype(np.complex64))
    levels = np.unique(y.real)
    assert np.array_equal(levels, -1 + step * np.arange(2**bits))
    assert np.array_equal(np.unique(y.imag), levels)
    inside = (x > -1) & (x < 1 - step)
    assert np.abs(y.real - x)[inside].max() <= step / 2 + 1e-6
    assert set(y.real[x < -1]) == {-1}
    assert set(y.real[x > 1]) == {1 - step}


def test_eight_bits_make_the_noise_of_eight_bits():
    x = 0.3 * noise(rng(), 50_000)
    y = FrontEnd(FrontEndParams(bits=8), rng()).receive(x)
    # Two axes of step² / 12.
    assert power_db(y - x) == pytest.approx(decibel(2 * (1 / 128) ** 2 / 12), abs=0.3)


@law(40)
@given(st.lists(st.integers(0, 700), min_size=1, max_size=20), st.sampled_from([0, 8]))
def test_any_chunking_of_a_front_end_gives_the_same_samples(sizes, bits):
    params = FrontEndParams(noise_dbfs=-20, image_db=30, dc_dbfs=-40, bits=bits)
    x = noise(rng(), sum(sizes), 0.01)
    before = x.copy()
    whole = FrontEnd(params, rng()).receive(x)
    front_end = FrontEnd(params, rng())
    parts = [front_end.receive(part) for part in np.split(x, np.cumsum(sizes)[:-1])]
    assert np.array_equal(np.concatenate(parts), whole)
    assert np.array_equal(x, before)


@pytest.mark.parametrize("profile", PROFILES)
def test_the_same_seed_gives_the_same_path(profile):
    params = PathParams(rate_hz=RATE, centre_hz=1e9, profile=profile, clock_ppm=3, delay_s=1e-5)
    x = noise(rng(), 500)
    one, other = (Path(params, rng()) for _ in range(2))
    for _ in range(3):
        (at, samples), (at_again, again) = one.carry(x), other.carry(x)
        assert at == at_again
        assert np.array_equal(samples, again)
    assert not np.array_equal(one.carry(x)[1], samples)


def test_an_unknown_profile_is_refused_with_those_that_exist():
    with pytest.raises(ValueError, match='"tdl-x"; allowed: one of awgn, rayleigh, tdl-a, tdl-c'):
        Path(PathParams(rate_hz=RATE, profile="tdl-x"), rng())


def test_a_plain_path_only_turns_and_weakens():
    x = noise(rng(), 1000)
    at, y = carry(x, loss_db=12.5)
    assert (at, len(y)) == (0, 1000)
    ratio = y / x
    assert np.ptp(np.abs(ratio)) < 1e-6
    assert decibel(np.abs(ratio[0]) ** 2) == pytest.approx(-12.5, abs=0.001)


def test_the_phase_is_any_phase():
    path = Path(PathParams(rate_hz=RATE), rng())
    turns = np.array([path.carry(np.ones(1, np.complex64))[1][0] for _ in range(2000)])
    assert np.abs(turns) == pytest.approx(1, abs=1e-6)
    assert abs(turns.mean()) < 0.07


@pytest.mark.parametrize("ppm", [-40, -1, 25])
def test_the_carrier_is_off_as_asked(ppm):
    _, y = carry(np.ones(10_000), centre_hz=2.4e9, clock_ppm=ppm)
    step = np.vdot(y[100:9000], y[101:9001])
    assert np.angle(step) / (2 * np.pi) * RATE == pytest.approx(2400 * ppm, abs=0.5)


@pytest.mark.parametrize("delay", [0.0, 0.1, 0.25, 0.5, 0.777, 0.999])
@pytest.mark.parametrize("clock_error", [0.0, 40e-6, -40e-6, 1e-3])
def test_samples_between_samples_are_right_in_band(delay, clock_error):
    """To -50 dB at all frequencies of the grid's subcarriers."""
    n = 4000
    y = stretch(band_limited(np.arange(n)).astype(np.complex64), delay, clock_error)
    inner = np.arange(50, n - 50)
    assert error_db(y[inner], band_limited(inner * (1 + clock_error) - delay)) < -50
    assert len(y) >= (n + delay) / (1 + clock_error)


@pytest.mark.parametrize("delay", [0, 0.3, 5, 5.5, 123.4])
def test_a_path_delays_as_asked(delay):
    n = 1000
    at, y = carry(band_limited(np.arange(n)), delay_s=delay / RATE)
    inner = np.arange(150, n - 50)
    wanted = band_limited(inner - delay)
    got = y[inner - at]
    assert error_db(got * np.vdot(got, wanted) / np.vdot(got, got), wanted) < -50


def test_leak_and_image_of_the_transmitter():
    x = 5 * turned(np.ones(4096), 0.125)
    _, y = carry(x, image_db=30, leak_db=20)
    spectrum = np.abs(np.fft.fft(y) / 4096) ** 2 / 25
    assert decibel(spectrum[[512, -512, 0]]) == pytest.approx([0, -30, -20], abs=0.05)


@pytest.mark.parametrize("delay", [0.0, 0.25, 1.0, 2.6])
def test_an_echo_comes_when_it_should(delay):
    taps = echo_filters(np.array([delay]), np.array([[1 + 0j]]))[0]
    t = np.arange(600)
    y = np.convolve(band_limited(t), taps)
    inner = np.arange(100, 500)
    wanted = band_limited(inner - (N_TAPS // 2 - 1) - delay)
    assert error_db(y[inner], wanted) < -50


def test_echoes_add_up():
    delays, gains = np.array([0.0, 0.4, 7.3]), np.array([1, 0.5j, -0.2])
    both = echo_filters(delays, gains[None, :])[0]
    for delay, gain in zip(delays, gains, strict=True):
        one = echo_filters(np.array([delay]), np.array([[gain]]))[0]
        both[: len(one)] -= one
    assert np.abs(both).max() < 1e-6


@pytest.mark.parametrize("profile", ["rayleigh", "tdl-a", "tdl-c"])
def test_fading_has_mean_gain_1_and_is_rayleigh(profile):
    params = PathParams(rate_hz=RATE, profile=profile, loss_db=3)
    path = Path(params, rng())
    x = np.zeros(40, np.complex64)
    x[0] = 1
    # At DC, the gain is the sum of all echoes: complex normal, with exponential power.
    gain = np.array([np.abs(path.carry(x)[1].sum()) ** 2 for _ in range(2500)]) * 10**0.3
    assert gain.mean() == pytest.approx(1, abs=0.06)
    for least in (0.1, 0.5, 2):
        assert np.mean(gain < least) == pytest.approx(1 - np.exp(-least), abs=0.03)


@pytest.mark.parametrize(("name", "n", "last"), [("tdl-a", 23, 9.6586), ("tdl-c", 24, 8.6523)])
def test_profiles_are_normalised(name, n, last):
    """TR 38.901, 7.7.3: the RMS delay spread is 1."""
    delay, power = np.array(PROFILES[name]).T
    share = 10 ** (power / 10) / np.sum(10 ** (power / 10))
    assert (len(delay), delay.max()) == (n, last)
    variance = np.sum(share * delay**2) - np.sum(share * delay) ** 2
    assert np.sqrt(variance) == pytest.approx(1, abs=0.005)


@pytest.mark.slow
@pytest.mark.parametrize("profile", ["tdl-a", "tdl-c"])
def test_echoes_have_the_delays_and_powers_of_the_profile(profile):
    params = PathParams(rate_hz=RATE, profile=profile, delay_spread_s=20 / RATE)
    path = Path(params, rng())
    x = np.zeros(40, np.complex64)
    x[0] = 1
    responses = [path.carry(x) for _ in range(800)]
    at, length = responses[0][0], len(responses[0][1])
    power = np.mean([np.abs(samples) ** 2 for _, samples in responses], axis=0)
    delay = at + np.arange(length)
    mean = np.sum(delay * power) / power.sum()
    assert np.sqrt(np.sum((delay - mean) ** 2 * power) / power.sum()) == pytest.approx(20, rel=0.08)
    listed = np.array(PROFILES[profile])
    share = 10 ** (listed[:, 1] / 10) / np.sum(10 ** (listed[:, 1] / 10))
    assert mean == pytest.approx(20 * np.sum(listed[:, 0] * share), rel=0.08)
    # The power that has arrived by several delays: the cumulated profile.
    for until in (0.8, 2, 5):
        came = power[delay <= 20 * until + 2].sum()
        assert came == pytest.approx(share[listed[:, 0] <= until].sum(), abs=0.05)


def test_moving_echoes_change_as_jakes_said():
    """Mean gain 1, and the correlation from t to t + τ is J0(2π f τ)."""
    doppler_hz, tau_s = 40.0, np.array([0.0, 0.002, 0.006, 0.0096])
    gains = np.stack([jakes(50, doppler_hz, tau_s, np.random.default_rng(i)) for i in range(60)])
    got = np.mean(gains * gains[:, :1].conj(), axis=(0, 2))
    assert got == pytest.approx(j0(2 * np.pi * doppler_hz * tau_s), abs=0.06)


def test_a_filter_that_does_not_move_is_a_convolution():
    x, taps = noise(rng(), 1000), noise(rng(), 40)
    moved = moving_filter(x, np.tile(taps, (-(-1000 // FADING_BLOCK), 1)))
    assert moved == pytest.approx(np.convolve(x, taps), abs=1e-4)


def test_a_fast_path_fades_within_a_burst_and_a_slow_one_does_not():
    x = np.ones(100_000, np.complex64)
    swing = {}
    for doppler_hz in (1e-5, 100.0):
        params = PathParams(rate_hz=1e6, profile="rayleigh", doppler_hz=doppler_hz)
        _, y = Path(params, rng()).carry(x)
        inner = np.abs(y[100:99_900])
        swing[doppler_hz] = inner.max() / inner.min()
    assert swing[1e-5] < 1.001
    assert swing[100.0] > 2


def test_phase_noise_has_its_spectrum():
    params = PathParams(rate_hz=1e6, phase_noise_dbc_hz=-80)
    n, spectra = 1 << 14, []
    for seed in range(100):
        _, y = Path(params, np.random.default_rng(seed)).carry(np.ones(n, np.complex64))
        phase = np.unwrap(np.angle(y))
        spectra.append(np.abs(np.fft.fft(np.diff(phase))[1:]) ** 2 / n)
    # The steps of a random walk are white: S(f) (2π f)² / rate.
    step = np.mean(spectra) * 1e6 / (2 * np.pi * 1e4) ** 2
    assert 10 * np.log10(step) == pytest.approx(-80, abs=0.3)
