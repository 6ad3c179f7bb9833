"""Tables: what the standard prints, and what must hold for each of them."""

import zlib

import numpy as np
import pytest

from phy import MCS_TABLE, OFDM_64_8, OFDM_64_16, Modulation, points
from phy.kernels import decode_block, fold
from phy.testing import BurstHeader, crc, header_bits, order, parse_header, polarity, whitening

# IEEE 802.11-2020, equation 17-25.
POLARITY = (
    "++++---+----++-+--++-++-++++++-+++-++--+++-+---+-+--+--+++++--++"
    "--+-+-++---++----+--+-++++-+-+-+-----+-++-+-+++--+---+++-------"
)

# IEEE 802.11-2020, 17.3.5.5: the scrambler's sequence from the state of all ones.
SCRAMBLER = (
    "00001110 11110010 11001001 00000010 00100110 00101110 10110110 00001100 "
    "11010100 11100111 10110100 00101010 11111010 01010001 10111000 1111111"
).replace(" ", "")


def test_the_pilots_follow_the_standards_polarity():
    sequence = polarity(127)
    assert np.array_equal(sequence, [1 if sign == "+" else -1 for sign in POLARITY])
    assert np.array_equal(sequence, [1 - 2 * int(bit) for bit in SCRAMBLER])


def test_the_polarity_repeats_and_may_begin_anywhere():
    assert np.array_equal(polarity(300, 127 * 3), polarity(300))
    assert np.array_equal(polarity(50, 2), polarity(52)[2:])
    most = 2 + -(-63 * 16 * 2051 + 12) // 48
    assert len(polarity(most)) == most


def test_whitening_is_balanced_and_goes_on_where_it_stopped():
    white = whitening(63 * 2051)
    assert len(white) == 63 * 2051
    assert np.array_equal(
        white, np.concatenate((whitening(1000), whitening(63 * 2051 - 1000, 1000)))
    )
    assert np.unpackbits(white).mean() == pytest.approx(0.5, abs=0.001)
    assert not np.array_equal(white[:256], white[256:512])


@pytest.mark.parametrize("modulation", Modulation)
def test_the_interleaver_is_a_permutation(modulation):
    n = 48 * modulation.bits
    assert np.array_equal(np.sort(order(n, modulation.bits)), np.arange(n))


@pytest.mark.parametrize("modulation", Modulation)
def test_the_standards_deinterleaver_undoes_the_interleaver(modulation):
    """Equations 17-22 and 17-23, which are not derived from our interleaver."""
    n, s = 48 * modulation.bits, max(modulation.bits // 2, 1)
    j = order(n, modulation.bits).astype(int)
    i = s * (j // s) + (j + 16 * j // n) % s
    assert np.array_equal(16 * i - (n - 1) * (16 * i // n), np.arange(n))


@pytest.mark.parametrize("modulation", Modulation)
def test_neighbouring_coded_bits_are_three_carriers_apart_at_least(modulation):
    subcarrier = order(48 * modulation.bits, modulation.bits) // modulation.bits
    assert np.abs(np.diff(subcarrier)).min() >= 3


# IEEE 802.11-2020, tables 17-12 to 17-15: levels of an axis by the bits in sending order.
AXIS = {
    "0": -1, "1": 1,
    "00": -3, "01": -1, "11": 1, "10": 3,
    "000": -7, "001": -5, "011": -3, "010": -1, "110": 1, "111": 3, "101": 5, "100": 7,
    "0000": -15, "0001": -13, "0011": -11, "0010": -9, "0110": -7, "0111": -5, "0101": -3,
    "0100": -1, "1100": 1, "1101": 3, "1111": 5, "1110": 7, "1010": 9, "1011": 11, "1001": 13,
    "1000": 15,
}  # fmt: skip
NORM = {
    Modulation.BPSK: 1, Modulation.QPSK: 2, Modulation.QAM16: 10, Modulation.QAM64: 42,
    Modulation.QAM256: 170,
}  # fmt: skip


@pytest.mark.parametrize("modulation", Modulation)
def test_points_are_the_standards(modulation):
    assert len(points(modulation)) == 2**modulation.bits
    for number, point in enumerate(points(modulation)):
        bits = f"{number:0{modulation.bits}b}"
        real, imag = bits[: modulation.axis_bits], bits[modulation.axis_bits :]
        level = AXIS[real] + (1j * AXIS[imag] if imag else 0)
        assert point == pytest.approx(level / np.sqrt(NORM[modulation]), abs=1e-6), bits


@pytest.mark.parametrize("modulation", Modulation)
def test_points_have_power_1_and_neighbors_differ_in_one_bit(modulation):
    table = points(modulation)
    assert np.mean(np.abs(table) ** 2) == pytest.approx(1, abs=1e-6)
    apart = np.abs(table[:, None] - table[None, :])
    near = np.argwhere(np.triu(np.isclose(apart, 2 * modulation.unit)))
    assert len(near) == {1: 1, 2: 4, 4: 24, 6: 112, 8: 480}[modulation.bits]
    assert apart[apart > 0].min() == pytest.approx(2 * modulation.unit)
    for one, other in near:
        assert int(one ^ other).bit_count() == 1


def test_the_mcs_table():
    assert [(mcs.index, mcs.name, float(mcs.bits_per_subcarrier)) for mcs in MCS_TABLE] == [
        (0, "BPSK 1/2", 0.5),
        (1, "QPSK 1/2", 1),
        (2, "QPSK 3/4", 1.5),
        (3, "16QAM 1/2", 2),
        (4, "16QAM 3/4", 3),
        (5, "64QAM 2/3", 4),
        (6, "64QAM 3/4", 4.5),
        (7, "64QAM 5/6", 5),
        (8, "256QAM 3/4", 6),
        (9, "256QAM 5/6", pytest.approx(20 / 3)),
    ]


@pytest.mark.parametrize("grid", [OFDM_64_16, OFDM_64_8])
def test_the_grid_is_the_standards(grid):
    assert list(grid.used[grid.pilots_at]) == [-21, -7, 7, 21]
    assert (grid.n_data, grid.n_used, grid.n_symbol - grid.n_cp) == (48, 52, 64)
    assert sorted({*grid.data_at, *grid.pilots_at}) == list(range(52))
    assert 0 not in grid.bins


def test_check_values():
    assert crc.crc8(b"123456789") == 0xF4
    assert crc.with_crc32(b"123456789") == b"123456789" + bytes.fromhex("cbf43926")


def test_a_wrong_bit_fails_the_check():
    block = crc.with_crc32(b"some bytes")
    assert crc.checked(block) == b"some bytes"
    for bit in range(8 * len(block)):
        wrong = bytearray(block)
        wrong[bit // 8] ^= 1 << bit % 8
        assert crc.checked(bytes(wrong)) is None
    assert zlib.crc32(b"some bytes") == int.from_bytes(block[-4:], "big")


def llr_of(coded):
    return ((1 - 2 * coded.astype(np.int16)) * 64).astype(np.int16)


def read(llr):
    """The header decoded from LLRs of its symbols."""
    folded, octets = np.empty(76, np.int16), np.empty(4, np.uint8)
    fold(llr, folded)
    decode_block(folded, np.empty(38, np.uint64), octets)
    return parse_header(octets, folded)


@pytest.mark.parametrize(
    "header",
    [BurstHeader(0, 1, 1, 0), BurstHeader(6, 63, 2047, 7), BurstHeader(3, 42, 220, 5)],
)
def test_a_header_is_read_as_it_was_written(header):
    coded = header_bits(header, 96)
    assert np.array_equal(coded[76:], coded[:20])
    assert read(llr_of(coded)) == header


@pytest.mark.parametrize("lost", [slice(0, 20), slice(76, 96)])
def test_either_copy_of_a_headers_first_bits_will_do(lost):
    header = BurstHeader(5, 33, 1234, 6)
    llr = llr_of(header_bits(header, 96))
    llr[lost] = 0
    assert read(llr) == header


def test_a_header_is_the_first_likely_word_whose_check_holds():
    """If noise makes another word the likeliest, the right one is usually next."""
    header, n_read, n_likeliest = BurstHeader(5, 33, 1234, 6), 0, 0
    draws = np.random.default_rng(7)
    for _ in range(400):
        y = 1 - 2.0 * header_bits(header, 96) + draws.standard_normal(96) * 1.0
        llr = np.clip(16 * y, -511, 511).astype(np.int16)
        folded, octets = np.empty(76, np.int16), np.empty(4, np.uint8)
        fold(llr, folded)
        decode_block(folded, np.empty(38, np.uint64), octets)
        n_likeliest += crc.crc8(octets[:3].tobytes()) == octets[3]
        n_read += read(llr) == header
    assert n_read > n_likeliest + 20
    assert n_read > 380


@pytest.mark.parametrize(
    "header", [BurstHeader(10, 1, 1, 0), BurstHeader(0, 0, 1, 0), BurstHeader(0, 1, 0, 0)]
)
def test_a_header_that_makes_no_sense_is_none(header):
    llr = llr_of(header_bits(header, 96))
    assert read(llr) is None
    assert read(np.zeros(96, np.int16)) is None
