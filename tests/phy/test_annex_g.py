"""Compares with the example of IEEE 802.11a-1999, Annex G."""

import numpy as np
import pytest

from phy import OFDM_64_16, Modulation
from phy.testing import compute, mapping, order, preamble, to_tones

# The standard's samples include the inverse FFT's 1/64; ours have mean power 1.
OURS = OFDM_64_16.scale
# The standard prints three decimals.
ROUNDING = 0.00071 * OURS

SIGNAL = "b13000"  # table G.7, the six tail bits included
SIGNAL_CODED = "d1a1023e7000"  # G.8
SIGNAL_INTERLEAVED = "94d014832494"  # G.9

# G.11, subcarriers -26 to 26 with pilots at ±7 and ±21; 0 is DC.
SIGNAL_CARRIERS = "+--+-++--++-+------+-+-+--0+-----+++--+--+--+---+-+--"

# G.12 from sample 16 on, half a period; all subcarriers are real, so the other half mirrors it.
SIGNAL_TIME = (
    -0.219, -0.069 - 0.027j, 0.018 + 0.083j, 0.008j, 0.010 - 0.097j, -0.060 - 0.124j,
    -0.033 - 0.044j, 0.011 + 0.002j, 0.098 + 0.044j, 0.136 + 0.105j, -0.021 + 0.005j,
    -0.001 + 0.113j, 0.007 + 0.100j, -0.081 - 0.084j, -0.002 + 0.038j, 0.033 + 0.044j, 0.062,
    0.057 + 0.052j, 0.016 + 0.174j, 0.035 + 0.116j, -0.051 - 0.202j, 0.011 + 0.036j,
    0.089 + 0.209j, -0.049 - 0.008j, -0.035 + 0.044j, 0.017 - 0.059j, 0.053 - 0.017j,
    0.099 + 0.100j, 0.034 - 0.148j, -0.003 - 0.094j, -0.120 + 0.042j, -0.136 - 0.070j, -0.031,
)  # fmt: skip

# G.5, subcarriers -26 to 26.
LONG_CARRIERS = "++--++-+-++++++--++-+-++++0+--++-+-+-----++--+-+-++++"

# G.6 from sample 32 on, half a period.
LONG_TIME = (
    0.156, -0.005 - 0.120j, 0.040 - 0.111j, 0.097 + 0.083j, 0.021 + 0.028j, 0.060 - 0.088j,
    -0.115 - 0.055j, -0.038 - 0.106j, 0.098 - 0.026j, 0.053 + 0.004j, 0.001 - 0.115j,
    -0.137 - 0.047j, 0.024 - 0.059j, 0.059 - 0.015j, -0.022 + 0.161j, 0.119 - 0.004j,
    0.062 - 0.062j, 0.037 + 0.098j, -0.057 + 0.039j, -0.131 + 0.065j, 0.082 + 0.092j,
    0.070 + 0.014j, -0.060 + 0.081j, -0.056 - 0.022j, -0.035 - 0.151j, -0.122 - 0.017j,
    -0.127 - 0.021j, 0.075 - 0.074j, -0.003 + 0.054j, -0.092 + 0.115j, 0.092 + 0.106j,
    0.012 + 0.098j, -0.156,
)  # fmt: skip

# G.3: one short segment.
SHORT_TIME = (
    0.046 + 0.046j, -0.132 + 0.002j, -0.013 - 0.079j, 0.143 - 0.013j, 0.092, 0.143 - 0.013j,
    -0.013 - 0.079j, -0.132 + 0.002j, 0.046 + 0.046j, 0.002 - 0.132j, -0.079 - 0.013j,
    -0.013 + 0.143j, 0.092j, -0.013 + 0.143j, -0.079 - 0.013j, 0.002 - 0.132j,
)  # fmt: skip


def bits(hexadecimal):
    return np.unpackbits(np.frombuffer(bytes.fromhex(hexadecimal), np.uint8))


def subcarriers(signs):
    """FFT bins `[64]` of signs for subcarriers -26 to 26."""
    spectrum = np.zeros(64)
    spectrum[np.arange(-26, 27) % 64] = ["-0+".index(sign) - 1 for sign in signs]
    return spectrum


def test_the_signal_field_is_coded():
    coded = np.empty((1, 48), np.uint8)
    compute.convolve(bits(SIGNAL)[None, :], coded)
    assert np.array_equal(coded[0], bits(SIGNAL_CODED))


def test_the_signal_field_is_interleaved():
    sent = np.empty(48, np.uint8)
    sent[order(48, 1)] = bits(SIGNAL_CODED)
    assert np.array_equal(sent, bits(SIGNAL_INTERLEAVED))


def test_the_signal_field_is_mapped_with_its_pilots():
    samples = mapping(Modulation.BPSK, OFDM_64_16).to_samples(bits(SIGNAL_CODED), 0, np.inf)
    re, im = to_tones(samples, np.array([16]), 0.0, 0j, OFDM_64_16)[0, :, :52]
    expected = subcarriers(SIGNAL_CARRIERS)[OFDM_64_16.bins[OFDM_64_16.tones]]
    assert re + 1j * im == pytest.approx(expected, abs=3e-6)


def mirrored(half):
    """A period `[64]` from one half `[33]`, as all subcarriers are real."""
    half = np.array(half)
    return OURS * np.concatenate((half, half[31:0:-1].conj()))


def test_the_signal_field_in_time():
    samples = mapping(Modulation.BPSK, OFDM_64_16).to_samples(bits(SIGNAL_CODED), 0, np.inf)
    assert samples[16:] == pytest.approx(mirrored(SIGNAL_TIME), abs=ROUNDING)
    assert np.array_equal(samples[:16], samples[64:])


def test_the_signal_field_back_from_time():
    samples = mirrored(SIGNAL_TIME).astype(np.complex64)
    re, im = to_tones(samples, np.array([0]), 0.0, 0j, OFDM_64_16)[0, :, :52]
    expected = subcarriers(SIGNAL_CARRIERS)[OFDM_64_16.bins[OFDM_64_16.tones]]
    assert re + 1j * im == pytest.approx(expected, abs=0.02)


def test_the_long_training_symbol():
    spectrum = np.fft.fft(preamble.long_symbol()) / OURS
    assert spectrum == pytest.approx(subcarriers(LONG_CARRIERS), abs=1e-5)
    assert preamble.long_symbol() == pytest.approx(mirrored(LONG_TIME), abs=ROUNDING)


def test_the_short_training_is_the_standards_under_a_cover():
    segments = preamble.preamble()[: preamble.SHORT].reshape(12, preamble.SEGMENT)
    assert segments[0] == pytest.approx(OURS * np.array(SHORT_TIME), abs=ROUNDING)
    signs = np.sum(segments[1:] * segments[:-1].conj(), axis=1).real
    assert np.array_equal(np.sign(signs), [1, 1, 1, -1, -1, -1, 1, -1, -1, 1, -1])
    assert np.array_equal(np.sign(signs), preamble.BARKER)
    values = preamble.short_subcarriers()[preamble.short_subcarriers() != 0]
    assert np.abs(values.real) == pytest.approx(1.472, abs=5e-4)


def test_the_preamble_is_short_training_a_guard_and_two_long_symbols_at_power_1():
    samples = preamble.preamble()
    assert len(samples) == preamble.length() == 352
    long = preamble.long_symbol()
    assert np.array_equal(samples[preamble.SHORT :], np.concatenate((long[32:], long, long)))
    for part in (samples, samples[: preamble.SHORT], samples[preamble.SHORT :]):
        assert np.mean(np.abs(part) ** 2) == pytest.approx(1, abs=0.02)
