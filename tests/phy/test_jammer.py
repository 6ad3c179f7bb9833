"""Jammers send what their parameters say, and the same in any chunks."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phy import Jammer
from tests.laws import law

RATE = 1e6
KINDS = {
    "tone": {"offset_hz": 2e5},
    "narrow": {"offset_hz": -1e5, "width_hz": 5e4},
    "sweep": {"period_s": 0.01},
    "pulses": {"period_s": 0.001, "duty": 0.1},
    "noise": {},
}
every_kind = pytest.mark.parametrize("kind", KINDS)


def jammer_of(kind, **more):
    return Jammer(kind, -20.0, RATE, 7, **{**KINDS[kind], **more})


def sent(kind, n, index=0, **more):
    return jammer_of(kind, **more).add(np.zeros(n, np.complex64), index)


@every_kind
def test_its_power_while_it_sends_is_as_told(kind):
    x = sent(kind, 50_000)
    on = x[np.abs(x) > 0] if kind == "pulses" else x
    assert 10 * np.log10(np.mean(np.abs(on) ** 2)) == pytest.approx(-20, abs=0.4)


@every_kind
@law(20)
@given(st.integers(0, 10**10), st.lists(st.integers(1, 3000), min_size=1, max_size=6))
def test_any_chunks_of_the_same_stream_are_the_same(kind, index, lengths):
    jammer, parts, at = jammer_of(kind), [], index
    for n in lengths:
        parts.append(jammer.add(np.zeros(n, np.complex64), at))
        at += n
    assert np.array_equal(np.concatenate(parts), sent(kind, sum(lengths), index))


@every_kind
def test_it_sends_at_its_times_and_leaves_the_signal_as_it_is_at_others(kind):
    x = np.full(3000, 0.5 + 0.5j, np.complex64)
    y = jammer_of(kind, times=[(0.001, 0.002)]).add(x, 0)
    assert np.all(x == np.complex64(0.5 + 0.5j))
    changed = np.flatnonzero(y != x)
    assert 1000 <= changed[0] < changed[-1] < 2000


def spectrum(x):
    """The share of the power at each frequency, and the frequencies."""
    power = np.abs(np.fft.fft(x * np.hanning(len(x)))) ** 2
    return power / power.sum(), np.fft.fftfreq(len(x), 1 / RATE)


@pytest.mark.parametrize(
    ("kind", "centre_hz", "width_hz"), [("tone", 2e5, 200), ("narrow", -1e5, 5.2e4)]
)
def test_its_power_is_where_it_is_told_to_be(kind, centre_hz, width_hz):
    share, at_hz = spectrum(sent(kind, 30_000))
    assert share[np.abs(at_hz - centre_hz) <= width_hz / 2].sum() > 0.99


def test_a_sweep_goes_through_the_band_once_in_its_period():
    x = sent("sweep", 10_000)
    at_hz = np.angle(x[1:] * x[:-1].conj()) * RATE / (2 * np.pi)
    assert at_hz[10] == pytest.approx(-4.99e5, rel=0.01)
    assert at_hz[5000] == pytest.approx(0, abs=1e3)
    assert at_hz[9989] == pytest.approx(4.99e5, rel=0.01)


def test_pulses_take_their_share_of_the_time():
    assert np.mean(np.abs(sent("pulses", 100_000)) > 0) == pytest.approx(0.1, abs=0.001)
