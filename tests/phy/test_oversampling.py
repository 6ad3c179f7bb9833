"""To a faster radio's rate and back: nothing that a burst needs is lost, and no image remains."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phy import REACH, Downsampler, Transmitter, upsample
from phy.testing import low_pass
from tests.laws import law
from tests.phy.signals import hear, heard, noise, noisy, payloads, silence

SEED = 91
factors = pytest.mark.parametrize("factor", [1, 2, 4])


def plain_upsample(x, factor):
    """Zeros between samples, then the filter, in numpy."""
    stuffed = np.zeros((len(x) + 2 * REACH) * factor, np.complex128)
    stuffed[REACH * factor : (REACH + len(x)) * factor : factor] = x
    taps = factor * low_pass(factor).astype(float)
    return np.convolve(stuffed, taps)[REACH * factor :][: len(stuffed)]


@factors
def test_upsampling_is_stuffing_and_filtering(factor):
    x = noise(np.random.default_rng(SEED), 100)
    assert upsample(x, factor) == pytest.approx(plain_upsample(x, factor), abs=1e-5)


@factors
def test_downsampling_is_filtering_and_taking_every_so_many(factor):
    x = noise(np.random.default_rng(SEED), 400)
    down = Downsampler(factor)
    out = np.concatenate((down.push(x), down.flush()))
    filtered = np.convolve(x, low_pass(factor).astype(float))[REACH * factor :][: len(x)]
    assert out == pytest.approx(filtered[::factor], abs=1e-5)
    assert down.next_index == len(out) == -(-len(x) // factor)


@law()
@given(
    st.sampled_from([1, 2, 4]),
    st.integers(0, 50),
    st.lists(st.integers(0, 90), max_size=12),
    st.integers(0, 2**32 - 1),
)
def test_any_chunking_gives_the_same_bit_for_bit(factor, start, sizes, seed):
    x = noise(np.random.default_rng(seed), sum(sizes))
    whole, pieces = Downsampler(factor), Downsampler(factor)
    whole.restart(start)
    pieces.restart(start)
    expected = np.concatenate((whole.push(x), whole.flush()))
    found, at = [np.zeros(0, np.complex64)], 0
    for n in sizes:
        before = pieces.next_index
        found.append(pieces.push(x[at : at + n]))
        assert pieces.next_index == before + len(found[-1])
        at += n
    assert np.concatenate((*found, pieces.flush())).tobytes() == expected.tobytes()
    # Each sample on the low rate's grid is reported.
    assert len(expected) == -(-(start + at) // factor) - -(-start // factor)


@factors
@pytest.mark.parametrize("mcs", [1, 9])
def test_a_burst_comes_through_as_it_was(factor, mcs):
    rng = np.random.default_rng(SEED)
    pdus = payloads(rng, 3, 200)
    burst = Transmitter().modulate(pdus, mcs)
    down = Downsampler(factor)
    x = np.concatenate((down.push(upsample(burst, factor)), down.flush()))
    # Its first and last samples are a step, which no filter passes.
    middle = x[REACH + 16 : REACH + len(burst) - 16]
    error = np.mean(np.abs(middle - burst[16:-16]) ** 2)
    assert error < 10 ** (-30 / 10)
    stream = noisy(rng, np.concatenate((silence(500), x, silence(100))), 35)
    assert heard(hear(stream)[0]) == pdus


@pytest.mark.parametrize("factor", [2, 4])
def test_no_image_is_left(factor):
    burst = Transmitter().modulate(payloads(np.random.default_rng(SEED), 20, 300), 1)
    x = upsample(burst, factor)
    power = np.abs(np.fft.fft(x * np.hanning(len(x)))) ** 2
    frequency = np.abs(np.fft.fftfreq(len(x), 1 / factor))
    inside = power[frequency < 26.5 / 64].mean()
    assert 10 * np.log10(power[frequency > 38 / 64].max() / inside) < -45
