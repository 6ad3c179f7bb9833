"""The length of bursts, compared with manual counts and with the transmitter."""

from fractions import Fraction
from math import ceil

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phy import (
    MAX_PDU_BYTES,
    MAX_PDUS,
    MCS_TABLE,
    OFDM_64_8,
    OFDM_64_16,
    Transmitter,
    layout,
    most_pdus,
)
from tests.laws import law

SEED = 23

grids = st.sampled_from([OFDM_64_16, OFDM_64_8])
mcs_indices = st.integers(0, len(MCS_TABLE) - 1)
pdu_counts = st.integers(1, MAX_PDUS)
pdu_sizes = st.integers(1, MAX_PDU_BYTES)


def test_limits_are_the_headers():
    assert (MAX_PDUS, MAX_PDU_BYTES) == (63, 2047)
    assert len(MCS_TABLE) <= 16


@pytest.mark.parametrize(
    ("mcs", "n_pdus", "size", "symbols", "samples"),
    [
        # 8 · 5 bits twice are 80; a symbol takes 48.
        (0, 1, 1, 2, 352 + 4 * 80),
        # 8 · 224, twice: 3584 on 96 a symbol.
        (1, 1, 220, 38, 352 + 40 * 80),
        (1, 2, 220, 75, 352 + 77 * 80),
        # 1792 · 4 / 3 are 2390 bits and a part, ten times, on 288 a symbol.
        (6, 10, 220, 83, 352 + 85 * 80),
    ],
)
def test_lengths_counted_by_hand(mcs, n_pdus, size, symbols, samples):
    plan = layout(OFDM_64_16, mcs, n_pdus, size)
    assert (plan.n_symbols, plan.n_samples) == (symbols, samples)


@law(60)
@given(grids, mcs_indices, pdu_counts, pdu_sizes)
def test_symbols_through_against_laying_out_every_pdu(grid, mcs, n_pdus, size):
    plan = layout(grid, mcs, n_pdus, size)
    entry = MCS_TABLE[mcs]
    sent = plan.coded_bits
    # At least the code's rate; extra parity only if it needs no additional symbol.
    assert sent >= 8 * (size + 4) / entry.rate
    least = ceil(n_pdus * ceil(8 * (size + 4) / entry.rate) / (48 * entry.modulation.bits))
    assert plan.n_symbols == least
    assert n_pdus * sent <= least * 48 * entry.modulation.bits
    owner = np.repeat(np.arange(n_pdus), sent)
    for number in (0, n_pdus // 2, n_pdus - 1):
        last_bit = np.flatnonzero(owner == number)[-1]
        symbol = last_bit // (48 * entry.modulation.bits)
        assert plan.symbols_through(number + 1) == symbol + 1
    assert plan.n_symbols == plan.symbols_through(n_pdus)


@law(40)
@given(grids, mcs_indices, pdu_counts, st.integers(1, 300))
def test_a_burst_is_as_long_as_its_layout_says_and_of_power_1(grid, mcs, n_pdus, size):
    pdus = [np.random.default_rng(SEED).bytes(size)] * n_pdus
    burst = Transmitter(grid=grid).modulate(pdus, mcs)
    assert burst.dtype == np.complex64
    assert len(burst) == layout(grid, mcs, n_pdus, size).n_samples
    assert np.mean(np.abs(burst) ** 2) == pytest.approx(1, abs=0.08)


@pytest.mark.parametrize("mcs", range(len(MCS_TABLE)))
def test_the_longest_burst_is_as_long_as_its_layout_says(mcs):
    burst = Transmitter().modulate([bytes(MAX_PDU_BYTES)] * MAX_PDUS, mcs)
    assert len(burst) == layout(OFDM_64_16, mcs, MAX_PDUS, MAX_PDU_BYTES).n_samples


def test_zeros_make_no_peaks():
    burst = Transmitter().modulate([bytes(1000)] * 3, 1)
    assert 10 * np.log10(np.max(np.abs(burst) ** 2)) < 12


@law(200)
@given(grids, mcs_indices, pdu_sizes, st.integers(0, 200_000))
def test_most_pdus_is_the_largest_number_that_fits(grid, mcs, size, n_samples):
    most = most_pdus(grid, mcs, size, n_samples)
    fits = [n for n in range(1, 64) if layout(grid, mcs, n, size).n_samples <= n_samples]
    assert most == max(fits, default=1)


def test_rates_of_long_bursts_approach_the_tables():
    for mcs in MCS_TABLE:
        plan = layout(OFDM_64_16, mcs.index, 63, 2047)
        least = ceil(63 * 8 * 2051 / (48 * mcs.bits_per_subcarrier))
        assert 0 <= Fraction(plan.n_symbols - least, least) < Fraction(1, 1000)


@pytest.mark.parametrize(
    ("mcs", "n_pdus", "size", "told"),
    [
        (10, 1, 1, "MCS: got 10; allowed: 0 to 9"),
        (-1, 1, 1, "MCS: got -1; allowed: 0 to 9"),
        (0, 0, 1, "PDUs in a burst: got 0; allowed: 1 to 63"),
        (0, 64, 1, "PDUs in a burst: got 64; allowed: 1 to 63"),
        (0, 1, 0, "bytes of a PDU: got 0; allowed: 1 to 2047"),
        (0, 1, 2048, "bytes of a PDU: got 2048; allowed: 1 to 2047"),
    ],
)
def test_errors_name_what_was_given_and_what_is_allowed(mcs, n_pdus, size, told):
    with pytest.raises(ValueError, match=f"^{told}$"):
        layout(OFDM_64_16, mcs, n_pdus, size)
    with pytest.raises(ValueError, match=f"^{told}$"):
        Transmitter().modulate([bytes(size)] * n_pdus, mcs)


def test_pdus_of_unequal_size_and_unknown_networks_are_refused():
    with pytest.raises(ValueError, match=r"got \[3, 5\]; allowed: one size in a burst"):
        Transmitter().modulate([bytes(3), bytes(5)], 0)
    for network in (-1, 8):
        with pytest.raises(ValueError, match=f"network: got {network}; allowed: 0 to 7"):
            Transmitter(network)


def test_a_burst_is_the_same_every_time():
    """Tables are shared and cached; no burst may modify them."""
    transmitter, pdus = Transmitter(3), [b"one", b"two"]
    first = transmitter.modulate(pdus, 4)
    first *= 0
    assert np.array_equal(transmitter.modulate(pdus, 4), Transmitter(3).modulate(pdus, 4))
    assert transmitter.modulate(pdus, 4).any()
