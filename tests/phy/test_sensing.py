"""Carrier sensing: bursts are sensed from end to end, noise is not, and the floor recovers."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phy import SENSE_WINDOW as WINDOW
from phy import EnergyDetector, Transmitter
from tests.laws import law
from tests.phy.signals import noise, noisy, payloads, silence, turned

SEED = 53
# Energy for more samples than this becomes noise; the floor never falls below -120 dBFS.
PATIENCE, LEAST_FLOOR = 40_000, 1e-12


def rng(seed=SEED):
    return np.random.default_rng(seed)


def a_burst(draws, mcs=1, n_pdus=3):
    burst = Transmitter().modulate(payloads(draws, n_pdus, 220), mcs)
    return turned(burst, draws.uniform(-0.02, 0.02), draws.random())


def sensed(samples, **settings):
    sense = EnergyDetector(**settings)
    sense.push(samples)
    return sense


def busy_windows(sense, samples):
    """Ends of the busy windows among `samples`, pushed window by window."""
    ends = []
    for first in range(0, len(samples), WINDOW):
        before = sense.busy_until
        sense.push(samples[first : first + WINDOW])
        if sense.busy_until != before:
            ends.append(sense.busy_until)
    return ends


def plainly(samples, threshold_db=6.0):
    """(ends of busy windows, floor) by the formula, term by term; no sample is bad."""
    floor, ends, run_from = None, [], 0
    windows = len(samples) // WINDOW
    powers = np.abs(samples[: windows * WINDOW].astype(np.complex128)) ** 2
    for k, p in enumerate(powers.reshape(windows, WINDOW).mean(axis=1)):
        if floor is None:
            floor = p
        elif p > floor * 10 ** (threshold_db / 10):
            if k * WINDOW >= (ends[-1] if ends else 0) + 4 * WINDOW:
                run_from = k * WINDOW
            ends.append((k + 1) * WINDOW)
            if ends[-1] - run_from > PATIENCE:
                floor = p
        elif p < floor / 2:
            floor = p
        else:
            floor += (p - floor) / 64
        floor = max(floor, LEAST_FLOOR)
    return ends, floor


@pytest.mark.parametrize("threshold_db", [3.0, 6.0, 15.0])
def test_it_follows_the_law(threshold_db):
    draws = rng()
    strength = np.repeat(10 ** draws.uniform(-1, 1, 400), draws.integers(1, 900, 400))
    x = (strength * noise(draws, len(strength))).astype(np.complex64)
    sense = EnergyDetector(threshold_db)
    ends, floor = plainly(x, threshold_db)
    assert len(ends) > 100
    assert busy_windows(sense, x) == ends
    assert sense.noise_dbfs == pytest.approx(10 * np.log10(floor), abs=1e-4)


def test_before_any_sample_nothing_is_known():
    sense = EnergyDetector(start=700)
    assert (sense.next_index, sense.busy_until, sense.noise_dbfs) == (700, 700, -120)


def test_silence_is_not_busy():
    sense = sensed(silence(100_000), start=-5)
    assert (sense.next_index, sense.busy_until, sense.noise_dbfs) == (99_995, -5, -120)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("power", [1e-9, 1.0])
def test_noise_is_not_busy(seed, power):
    sense = sensed(noise(rng(seed), 2_000_000, power))
    assert (sense.next_index, sense.busy_until) == (2_000_000, 0)
    assert sense.noise_dbfs == pytest.approx(10 * np.log10(power), abs=0.3)


@pytest.mark.parametrize("seed", range(20))
def test_a_burst_at_10_db_is_sensed_from_end_to_end(seed):
    """To one window, and without interruption; the floor is constant."""
    draws = rng(seed)
    begin = 20_000 + int(draws.integers(0, WINDOW))
    burst = a_burst(draws, mcs=seed % 7)
    end = begin + len(burst)
    x = noisy(draws, np.concatenate((silence(begin), burst, silence(20_000))), 10)
    sense = EnergyDetector()
    ends = busy_windows(sense, x)
    assert abs(ends[0] - WINDOW - begin) < WINDOW
    assert abs(ends[-1] - end) < WINDOW
    assert all(later - earlier == WINDOW for earlier, later in pairwise(ends))
    assert sense.noise_dbfs == pytest.approx(-10, abs=0.3)


def test_the_yardstick_tells_strong_from_weak():
    """The control: 10 dB below the noise, a burst is not sensed."""
    draws = rng()
    x = noisy(draws, np.concatenate((silence(20_000), a_burst(draws))), -10)
    assert busy_windows(EnergyDetector(), x) == []


def test_a_start_within_a_burst_is_over_when_the_burst_is():
    """The burst is taken for the floor; the first windows after it correct that."""
    draws = rng()
    first, second = a_burst(draws), a_burst(draws)
    x = np.concatenate((first[1000:], silence(2000), second, silence(2000)))
    begin = len(first) + 1000
    ends = busy_windows(EnergyDetector(), noisy(draws, x, 20))
    assert abs(ends[0] - WINDOW - begin) < WINDOW
    assert abs(ends[-1] - begin - len(second)) < WINDOW


@pytest.mark.parametrize("rise_db", [9, 30, 60])
@pytest.mark.parametrize("patience", [40_000, 200_000])
def test_a_carrier_that_never_ends_becomes_noise(rise_db, patience):
    """In as many samples as were said; when it ends, the floor is back at once."""
    draws = rng()
    sense = sensed(noise(draws, 6400), patience=patience)
    carrier = noise(draws, patience + 128 * WINDOW, 10 ** (rise_db / 10))
    last = busy_windows(sense, carrier)[-1] - 6400
    assert patience < last < patience + 16 * WINDOW
    assert sense.noise_dbfs == pytest.approx(rise_db, abs=1)
    sense.push(noise(draws, 64 * WINDOW))
    assert sense.noise_dbfs == pytest.approx(0, abs=0.7)
    assert busy_after(sense, 3 * noise(draws, 640)) >= sense.next_index - WINDOW


def test_energy_that_a_burst_explains_is_no_noise():
    """Bursts that follow one another closely are energy for as long as they last."""
    draws = rng()
    sense = sensed(noise(draws, 6400))
    for _ in range(10):
        sense.explain(sense.next_index + 20_000)
        assert len(busy_windows(sense, noise(draws, 400 * WINDOW, 100))) == 400
    sense.explain(0)
    ends = busy_windows(sense, noise(draws, 1000 * WINDOW, 100))
    assert PATIENCE - 6400 < ends[-1] - sense.next_index + 1000 * WINDOW < PATIENCE


@pytest.mark.parametrize("before", [silence(64_000), 1e-3 * noise(rng(), 64_000)])
def test_a_radio_that_begins_in_silence_is_busy_for_no_longer_than_the_patience(before):
    sense = sensed(before)
    ends = busy_windows(sense, noise(rng(), 2 * PATIENCE))
    assert PATIENCE < ends[-1] - len(before) < PATIENCE + 16 * WINDOW


def busy_after(sense, samples):
    sense.push(samples)
    return sense.busy_until


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e7, 1e30, 3e38, complex(0, np.nan)])
@pytest.mark.parametrize("every", [1, 7, 1000])
def test_bad_samples_are_no_carrier_and_teach_the_floor_nothing(bad, every):
    draws = rng()
    sense = sensed(noise(draws, 100_000))
    floor = sense.noise_dbfs
    spoilt = noise(draws, 50_000)
    spoilt[::every] = bad
    with np.errstate(over="raise", invalid="raise"):
        sense.push(spoilt)
    assert sense.noise_dbfs == pytest.approx(floor, abs=0.3)
    sense.push(noise(draws, 100_000))
    assert sense.busy_until == 0
    burst = noisy(draws, a_burst(draws), 10) * np.float32(10**0.5)
    assert busy_after(sense, burst) > sense.next_index - 2 * WINDOW


def test_a_burst_with_bad_samples_is_still_a_burst():
    draws = rng()
    x = noisy(draws, np.concatenate((silence(6400), a_burst(draws))), 10)
    x[::9] = np.nan
    x[:6400] = noise(draws, 6400, 0.1)
    assert len(busy_windows(EnergyDetector(), x)) == (len(x) - 6400) // WINDOW


def test_a_stream_that_begins_with_bad_samples_has_no_floor_yet():
    sense = sensed(np.full(6400, np.nan, np.complex64))
    sense.push(noise(rng(), 6400))
    assert sense.busy_until == 0
    assert sense.noise_dbfs == pytest.approx(0, abs=1)


@pytest.mark.parametrize("power", [1e-30, 1e-12, 1e12])
def test_the_least_and_the_largest_numbers(power):
    sense = sensed(noise(rng(), 64_000, power / 100))
    assert np.isfinite(sense.noise_dbfs)
    assert sense.noise_dbfs >= -120
    assert sense.busy_until == 0


def test_windows_begin_behind_a_gap_and_the_floor_is_kept():
    draws = rng()
    sense = sensed(noise(draws, 6400 + 63), start=1000)
    floor = sense.noise_dbfs
    # With one more sample, the samples before the gap would have made a busy window.
    sense.gap(937)
    assert (sense.next_index, sense.noise_dbfs) == (8400, floor)
    sense.push(10 * noise(draws, 63))
    assert sense.busy_until == 1000
    sense.push(10 * noise(draws, 1))
    assert sense.busy_until == sense.next_index == 8464
    sense.gap(0)
    assert sense.busy_until == sense.next_index == 8464


def test_what_makes_no_sense_is_refused():
    for threshold_db in (0, -3, np.nan, np.inf):
        with pytest.raises(ValueError, match="allowed: more than 0"):
            EnergyDetector(threshold_db)
    with pytest.raises(ValueError, match="allowed: 0 or more"):
        EnergyDetector().gap(-1)


def make_stream(seed):
    """(samples, positions of gaps): bursts, noise, zeros, bad samples."""
    draws = rng(seed)
    parts = [noise(draws, int(draws.integers(0, 500)))]
    for _ in range(int(draws.integers(1, 6))):
        parts += [float(draws.choice([0.01, 3, 30])) * a_burst(draws, mcs=6, n_pdus=1)]
        parts += [silence(int(draws.integers(0, 300)))]
    x = noisy(draws, np.concatenate(parts), float(draws.choice([0, 20, 200])))
    if draws.random() < 0.5:
        x[draws.integers(0, len(x), 5)] = np.nan
    return x, np.sort(draws.integers(0, len(x), 2))


def told(x, cuts, gaps):
    """All results for `x` cut at `cuts`, with 100 samples missing at each of `gaps`."""
    sense = EnergyDetector()
    for first, last in pairwise([0, *cuts, len(x)]):
        if first in gaps:
            sense.gap(100)
        sense.push(x[first:last])
    return sense.next_index, sense.busy_until, sense.noise_dbfs


@law(150)
@given(st.integers(0, 2**32), st.lists(st.floats(0, 1), max_size=40), st.booleans())
def test_any_chunking_tells_the_same(seed, cuts, with_gaps):
    """Some chunks are empty: a cut may be repeated, but a gap may not."""
    x, gaps = make_stream(seed)
    gaps = sorted(set(gaps)) if with_gaps else []
    at = [int(cut * len(x)) for cut in cuts]
    wanted = told(x, gaps, gaps)
    assert told(x, sorted(gaps + [cut for cut in at + at[:5] if cut not in gaps]), gaps) == wanted
    assert told(x, sorted({*gaps, *range(1, len(x), 7)}), gaps) == wanted


def test_any_array_will_do_and_is_left_alone():
    draws = rng()
    x = noisy(draws, np.concatenate((silence(6400), a_burst(draws))), 10)
    x[100] = np.nan
    before = x.copy()
    wanted = told(x, [], [])
    assert np.array_equal(x, before, equal_nan=True)
    x[0] = before[0]  # still writable
    assert told(np.frombuffer(x.tobytes(), np.complex64), [], []) == wanted
    assert told(np.repeat(x, 2)[::2], [], []) == wanted
    assert told(x.astype(np.complex128), [], []) == wanted
