"""Compares the formula for packet errors with the modem itself."""

from itertools import pairwise

import numpy as np
import pytest

from phy import (
    MCS_TABLE,
    OFDM_64_16,
    BurstOver,
    FrontEnd,
    FrontEndParams,
    Path,
    PathParams,
    PduHeard,
    Receiver,
    Transmitter,
    burst_found_rate,
    layout,
    needed_snr_db,
    pdu_error_rate,
)
from tests.phy.signals import silence

SEED = 61
N = 200

every_mcs = pytest.mark.parametrize("mcs", range(len(MCS_TABLE)))
low_middle_high = pytest.mark.parametrize("mcs", [0, 3, 6, 9])


def n_together(mcs, pdu_bytes):
    """Number of PDUs in a burst that leave its last symbol little room for extra parity."""
    plans = (layout(OFDM_64_16, mcs, n, pdu_bytes) for n in range(1, 64))
    return next(plan.n_pdus for plan in plans if plan.coded_bits <= 1.01 * plan.least_bits)


def measured(mcs, pdu_bytes, snr_db, n_pdus, seed=SEED):
    """(share of bursts found, packet error rate) of at least `n_pdus` in white noise."""
    rng = np.random.default_rng(seed)
    transmitter, receiver = Transmitter(), Receiver()
    front_end = FrontEnd(FrontEndParams(noise_dbfs=-snr_db), rng)
    n = n_together(mcs, pdu_bytes)
    n_bursts = -(-n_pdus // n)
    n_found = n_good = 0
    for _ in range(n_bursts):
        pdus = [rng.bytes(pdu_bytes) for _ in range(n)]
        path = Path(PathParams(1e6, 2.45e9, clock_ppm=rng.uniform(-2, 2)), rng)
        _, burst = path.carry(transmitter.modulate(pdus, mcs))
        x = np.concatenate((silence(int(rng.integers(200, 800))), burst))
        events = receiver.push(front_end.receive(x)) + receiver.flush()
        n_good += len([event for event in events if isinstance(event, PduHeard)])
        n_found += any(told(event, mcs, n, pdu_bytes) for event in events)
    return n_found / n_bursts, 1 - n_good / (n_bursts * n)


def told(event, mcs, n_pdus, pdu_bytes):
    """Whether the event is a burst with the header that was sent."""
    return isinstance(event, BurstOver) and event.burst[1:5] == (mcs, n_pdus, pdu_bytes, 0)


@low_middle_high
def test_a_little_more_than_the_needed_snr_is_enough(mcs):
    assert measured(mcs, 220, needed_snr_db(mcs, 220) + 0.7, N)[1] < 0.05


@low_middle_high
def test_less_than_the_needed_snr_is_not(mcs):
    """With 1.2 dB less, about half are lost."""
    assert measured(mcs, 220, needed_snr_db(mcs, 220) - 1.2, N)[1] > 0.2


@pytest.mark.parametrize("pdu_bytes", [64, 1024])
@low_middle_high
def test_half_are_lost_where_the_law_says_so(mcs, pdu_bytes):
    """For other sizes than the reference; 0.2 is five sigma, or 0.3 dB."""
    snr_db = needed_snr_db(mcs, pdu_bytes, per=0.5)
    assert measured(mcs, pdu_bytes, snr_db, N)[1] == pytest.approx(0.5, abs=0.2)


@pytest.mark.parametrize("snr_db", [-6.0, -4.5, -3.0, -1.0])
def test_bursts_are_found_as_often_as_the_law_says(snr_db):
    assert measured(1, 9, snr_db, N)[0] == pytest.approx(burst_found_rate(snr_db), abs=0.14)


@every_mcs
@pytest.mark.parametrize("pdu_bytes", [1, 64, 220, 1024, 2047])
def test_the_rate_falls_from_1_to_0_as_snr_grows(mcs, pdu_bytes):
    rates = [pdu_error_rate(mcs, snr_db, pdu_bytes) for snr_db in np.arange(-30, 60, 0.5)]
    assert all(later <= earlier for earlier, later in pairwise(rates))
    assert rates[0] == pytest.approx(1)
    assert rates[-1] < 1e-12


@every_mcs
@pytest.mark.parametrize("per", [1e-9, 1e-3, 0.01, 0.5, 0.99])
def test_the_needed_snr_gives_that_rate(mcs, per):
    snr_db = needed_snr_db(mcs, 220, per)
    assert pdu_error_rate(mcs, snr_db, 220) == pytest.approx(per, rel=1e-4)


def test_more_bits_need_more_and_so_do_short_codes_and_many():
    needed = [[needed_snr_db(mcs, size) for size in (16, 64, 220, 1024, 2047)] for mcs in range(10)]
    assert (np.diff(needed, axis=0) > 1).all()
    # A single short codeword needs more SNR than a long one; many need no less than few.
    assert (np.diff(needed, axis=1)[:, 0] < 0).all()
    assert (np.diff(needed, axis=1)[:, 3] > -0.02).all()


def test_a_burst_that_is_not_found_is_a_pdu_lost():
    for mcs in range(10):
        for snr_db in (-8.0, -4.0, 0.0, 10.0):
            assert pdu_error_rate(mcs, snr_db, 64) >= 1 - burst_found_rate(snr_db)


@pytest.mark.parametrize("snr_db", [-1e6, -np.inf, 1e6, np.inf])
def test_the_largest_and_the_least_snr(snr_db):
    assert pdu_error_rate(6, snr_db, 2047) == (snr_db < 0)
    assert burst_found_rate(snr_db) == (snr_db > 0)


def test_what_no_header_can_tell_is_refused():
    for mcs, size, what in (
        (-1, 220, "MCS"),
        (10, 220, "MCS"),
        (0, 0, "bytes"),
        (0, 2048, "bytes"),
    ):
        with pytest.raises(ValueError, match=what):
            pdu_error_rate(mcs, 10, size)
        with pytest.raises(ValueError, match=what):
            needed_snr_db(mcs, size)
    for per in (0, 1, -0.1, 1.5, np.nan):
        with pytest.raises(ValueError, match="packet error rate"):
            needed_snr_db(0, 220, per)
