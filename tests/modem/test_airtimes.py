"""The length of bursts, and what fits into them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

import phy
from sdrlinkd.config import ModemParams
from sdrlinkd.modem import Airtimes
from tests.laws import law

INFINITE = float("inf")
N_MCS = len(phy.MCS_TABLE)


def make(rate_hz=5e6, max_burst_s=0.005, pdu_size=220):
    return Airtimes(ModemParams(rate_hz=rate_hz, max_burst_s=max_burst_s), pdu_size)


parameters = st.tuples(
    st.sampled_from([1e5, 1e6, 5e6, 20e6, 61.44e6, 1e7 / 3]),
    st.sampled_from([1e-4, 0.001, 0.005, 0.0123, 0.5]),
    st.sampled_from([32, 64, 220, 1024, 2047]),
)
airtimes = parameters.map(lambda given: make(*given))
mcs_numbers = st.integers(0, N_MCS - 1)


@pytest.mark.parametrize("mcs", range(N_MCS))
@pytest.mark.parametrize("n_pdus", [1, 7])
def test_a_burst_is_as_long_as_its_samples(mcs, n_pdus):
    pdus = [bytes(220)] * n_pdus
    samples = phy.Transmitter().modulate(pdus, mcs)
    assert make().samples(mcs, n_pdus) == len(samples)
    assert make().airtime_s(mcs, n_pdus) == len(samples) / 5e6


@law(150)
@given(parameters, mcs_numbers, st.floats(0, 0.6))
def test_what_is_said_to_fit_fits_and_no_more_would(params, mcs, airtime_s):
    times, (rate_hz, max_burst_s, _) = make(*params), params
    most = times.most_pdus(mcs, airtime_s)
    if most:
        assert times.airtime_s(mcs, most) <= airtime_s * (1 + 1e-9)
    if 0 < most < phy.MAX_PDUS:
        longer = times.airtime_s(mcs, most + 1)
        assert longer > airtime_s or longer > round(max_burst_s * rate_hz) / rate_hz
    if not most:
        assert times.airtime_s(mcs, 1) > airtime_s


@law(150)
@given(airtimes, mcs_numbers, st.integers(1, phy.MAX_PDUS))
def test_a_burst_fits_into_its_own_length(times, mcs, n_pdus):
    most = times.most_pdus(mcs, INFINITE)
    n_pdus = min(n_pdus, most)
    assert times.most_pdus(mcs, times.airtime_s(mcs, n_pdus)) == n_pdus


@pytest.mark.parametrize("mcs", range(N_MCS))
@pytest.mark.parametrize("max_burst_s", [0.001, 0.005])
def test_bursts_of_several_pdus_are_as_long_as_allowed_and_no_longer(mcs, max_burst_s):
    times = make(max_burst_s=max_burst_s)
    for room_s in (INFINITE, 1.0, 2 * max_burst_s):
        most = times.most_pdus(mcs, room_s)
        assert most == 1 or times.airtime_s(mcs, most) <= max_burst_s
        assert most == phy.MAX_PDUS or times.airtime_s(mcs, most + 1) > max_burst_s


def test_one_pdu_may_be_longer_than_bursts_of_several():
    times = make(rate_hz=1e5, max_burst_s=0.001)
    assert times.airtime_s(0, 1) > 0.001
    assert times.most_pdus(0, INFINITE) == 1
    assert times.longest_s()[0] == times.airtime_s(0, 1)


@law(50)
@given(airtimes)
def test_the_longest_is_the_longest_that_is_ever_sent(times):
    for mcs, longest_s in enumerate(times.longest_s()):
        assert longest_s == times.airtime_s(mcs, times.most_pdus(mcs, INFINITE))
        assert times.most_pdus(mcs, longest_s + 1e-3) == times.most_pdus(mcs, INFINITE)
