"""The reference transmitter sends what the modem's sends, sample by sample."""

import inspect

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phy import GRIDS, MCS_TABLE, Transmitter, reference
from phy.reference import header
from phy.testing import BurstHeader, checked_header, header_bits
from tests.laws import law
from tests.phy.signals import payloads

SEED = 71
# Relative to the samples' RMS, which is 1. Single precision rounds by about 6e-8 per step.
ROUNDING = 3e-6

every_mcs = pytest.mark.parametrize("mcs", range(len(MCS_TABLE)))
every_grid = pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)


def error(pdus, mcs, **settings):
    """The largest difference between the samples of the two transmitters' bursts."""
    ours = Transmitter(**settings).modulate(pdus, mcs)
    other = reference.Transmitter(**settings).modulate(pdus, mcs)
    assert (other.dtype, other.shape) == (ours.dtype, ours.shape)
    return np.abs(ours - other).max()


@every_mcs
@every_grid
@pytest.mark.parametrize(("n_pdus", "size"), [(1, 1), (3, 100), (20, 220)])
def test_samples_are_the_same(mcs, grid, n_pdus, size):
    pdus = payloads(np.random.default_rng(SEED), n_pdus, size)
    assert error(pdus, mcs, grid=grid) < ROUNDING


@every_mcs
@pytest.mark.parametrize(("n_pdus", "size"), [(63, 1), (1, 2047), (2, 2047), (63, 40)])
def test_corners_are_the_same(mcs, n_pdus, size):
    assert error(payloads(np.random.default_rng(SEED), n_pdus, size), mcs) < ROUNDING


@pytest.mark.parametrize("network", range(8))
@pytest.mark.parametrize("boost_db", [0.0, 1.7, 3.0])
def test_networks_and_stronger_preambles_are_the_same(network, boost_db):
    pdus = payloads(np.random.default_rng(SEED), 2, 50)
    assert error(pdus, 4, network=network, preamble_boost_db=boost_db) < ROUNDING


def test_the_yardstick_tells_one_bit():
    """The control: a burst with one changed bit in one PDU."""
    ours = Transmitter().modulate([b"to and fro"], 9)
    other = reference.Transmitter().modulate([b"to and frn"], 9)
    assert np.abs(ours - other).max() > 0.1


def test_it_has_the_modems_face():
    for method in ("__init__", "modulate"):
        ours = inspect.signature(getattr(Transmitter, method))
        assert inspect.signature(getattr(reference.Transmitter, method)) == ours


@pytest.mark.parametrize(
    ("settings", "call", "told"),
    [
        ({"network": 8}, ([b"x"], 0), "network: got 8; allowed: 0 to 7"),
        ({"preamble_boost_db": 3.1}, ([b"x"], 0), "preamble boost: got 3.1 dB; allowed: 0 to 3"),
        ({}, ([b"x"], 10), "MCS: got 10; allowed: 0 to 9"),
        ({}, ([], 0), "PDUs in a burst: got 0; allowed: 1 to 63"),
        ({}, ([b"x", b"yz"], 0), r"bytes of a PDU: got \[1, 2\]; allowed: one size in a burst"),
    ],
)
@pytest.mark.parametrize("kind", [Transmitter, reference.Transmitter])
def test_what_cannot_be_sent_is_refused_in_the_same_words(kind, settings, call, told):
    with pytest.raises(ValueError, match=told):
        kind(**settings).modulate(*call)


@law()
@given(st.integers(0, 15), st.integers(0, 63), st.integers(0, 2047), st.integers(0, 7))
def test_headers_are_coded_and_told_as_the_modem_does(mcs, n_pdus, pdu_bytes, network):
    told = BurstHeader(mcs, n_pdus, pdu_bytes, network)
    coded = header.header_bits(told, 96)
    assert np.array_equal(coded, header_bits(told, 96))
    octets = header_octets(coded)
    assert header.checked(octets) == checked_header(octets)
    assert header.checked(octets) == (told if mcs < 10 and n_pdus and pdu_bytes else None)
    wrong = bytes([octets[0] ^ 1, *octets[1:]])
    assert header.checked(wrong) is checked_header(wrong) is None


def header_octets(coded):
    """Four octets from their coded bits: A and B are each bit's contribution."""
    bits = np.zeros(32, np.uint8)
    for t in range(32):
        bits[t] = reference.viterbi.encode(bits)[2 * t] ^ coded[2 * t]
    return np.packbits(bits).tobytes()
