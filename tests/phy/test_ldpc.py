"""LDPC codes: the standard's codewords, blocks of any size, and the noise that they tolerate."""

import hashlib
import zlib
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phy.kernels import bits as words_of_bits
from phy.kernels import decode_codeword
from phy.reference import ldpc as reference
from phy.testing import LIFTINGS, QuasiCyclic, Segmentation, ldpc, least_coded, segmentation
from tests.laws import law, often

RATES = [Fraction(1, 2), Fraction(2, 3), Fraction(3, 4), Fraction(5, 6)]
CODES = [QuasiCyclic(z, rate) for z in LIFTINGS for rate in RATES]
SEED = 5

# CRC-32 of codewords found by Gaussian elimination over GF(2) for information SHA-256 of 0, 1, …
CODEWORDS = {
    (27, "1/2"): 0x05CFA884,
    (27, "2/3"): 0xA3320602,
    (27, "3/4"): 0x3445B4D3,
    (27, "5/6"): 0xB9CFD45F,
    (54, "1/2"): 0x2B0C1CD2,
    (54, "2/3"): 0xFAB19F34,
    (54, "3/4"): 0x7BCE9707,
    (54, "5/6"): 0x27BC4936,
    (81, "1/2"): 0x18C53B1D,
    (81, "2/3"): 0x9A352753,
    (81, "3/4"): 0xEC97F8D8,
    (81, "5/6"): 0xE0E81C18,
}

codes = pytest.mark.parametrize("code", CODES, ids=lambda code: f"{code.n}-{code.rate}")


def parity_check(code):
    """The complete matrix `[n - k, n]`, block by block."""
    matrix = np.zeros((code.n - code.k, code.n), np.int64)
    lanes = np.arange(code.z)
    for row, column in zip(*np.nonzero(code.base >= 0), strict=True):
        shifted = column * code.z + (lanes + code.base[row, column]) % code.z
        matrix[row * code.z + lanes, shifted] = 1
    return matrix


def decoded(llr, form, work):
    """Bits `[blocks, n_bits]`."""
    return np.unpackbits(ldpc.decode(llr, form, work), axis=1)


def random_bits(rng, *shape):
    return rng.integers(0, 2, shape).astype(np.uint8)


def whole(code):
    """Blocks that are whole codewords."""
    return Segmentation(code, code.k, 1, code.n)


def encoded(code, bits):
    return ldpc.encode(bits[None], whole(code))[0]


def noisy(rng, coded, ebn0_db, rate, scale=8):
    """LLRs of antipodal bits, as the demapper makes them."""
    variance = 10 ** (-ebn0_db / 10) / (2 * float(rate))
    y = 1 - 2.0 * coded + np.sqrt(variance) * rng.standard_normal(coded.shape)
    return np.clip(np.round(2 * scale * y / variance), -511, 511).astype(np.int16)


def solved(matrix, right):
    """The bits `x` with `matrix · x = right` over GF(2), by elimination; `matrix` has full rank."""
    rows = np.concatenate((matrix, right[:, None]), axis=1) % 2 == 1
    n = len(rows)
    for column in range(n):
        pivot = column + int(np.argmax(rows[column:, column]))
        assert rows[pivot, column], "the matrix has full rank"
        rows[[column, pivot]] = rows[[pivot, column]]
        others = rows[:, column].copy()
        others[column] = False
        rows[others] ^= rows[column]
    return rows[:, n].astype(np.uint8)


@codes
def test_parity_is_what_solving_the_checks_gives(code):
    """H · c = 0 has one solution for each information word, whatever the shape of H."""
    matrix, rng = parity_check(code), np.random.default_rng(SEED)
    for _ in range(3):
        data = random_bits(rng, code.k)
        parity = solved(matrix[:, code.k :], matrix[:, : code.k] @ data)
        assert np.array_equal(encoded(code, data), np.concatenate((data, parity)))


@codes
def test_codewords_are_those_that_elimination_finds(code):
    n_digests = -(-code.k // 256)
    data = b"".join(hashlib.sha256(bytes([i])).digest() for i in range(n_digests))
    bits = np.unpackbits(np.frombuffer(data, np.uint8))[: code.k].copy()
    word = np.packbits(encoded(code, bits)).tobytes()
    rate = f"{code.rate.numerator}/{code.rate.denominator}"
    assert zlib.crc32(word) == CODEWORDS[code.z, rate]


@codes
def test_every_check_holds_for_every_codeword(code):
    rng = np.random.default_rng(SEED)
    matrix = parity_check(code)
    words = np.array([encoded(code, random_bits(rng, code.k)) for _ in range(20)])
    assert not np.any(words @ matrix.T % 2)
    # Each bit is in at least one check, and each check has as many bits as its row has edges.
    assert np.all(matrix.sum(axis=0) >= 1)
    assert np.array_equal(matrix.sum(axis=1), np.repeat(np.diff(code.row_ends), code.z))


@codes
def test_the_vectors_do_what_the_reference_says_bit_for_bit(code):
    """With noise from little to hopeless, and with values at the limits of the range."""
    rng = np.random.default_rng(SEED)
    work, form = ldpc.new_workspace().content, ldpc.packed_form(whole(code)).content
    outcomes = set()
    for ebn0_db, at_edges in ((9.0, 0), (6.0, 0), (3.0, 0), (2.0, 20), (-3.0, 5)):
        word = encoded(code, random_bits(rng, code.k))
        llr = noisy(rng, word, ebn0_db, code.rate)
        most = reference.MAX_POSTERIOR
        edges = rng.choice([-511, 0, most, -most, 1, -1], at_edges)
        llr[rng.integers(0, code.n, at_edges)] = edges
        for n in (1, 2, 12):
            took = decode_codeword(llr, form, n, work)
            expected, posteriors = reference.decode_codeword(llr, code, n)
            assert took == expected, (SEED, ebn0_db, n)
            assert np.array_equal(work.posteriors[:, : code.z], posteriors), (SEED, ebn0_db, n)
            outcomes.add(took > 0)
    assert outcomes == {True, False}


@law(60)
@given(st.integers(1, 2047 + 4), st.sampled_from(RATES), st.floats(0, 1), st.integers(0, 2**32 - 1))
def test_blocks_of_any_size_come_back(n_bytes, rate, more, seed):
    rng = np.random.default_rng(seed)
    least = least_coded(8 * n_bytes, rate)
    room = round(least * (1 + more))
    form = segmentation(8 * n_bytes, rate, room)
    n_blocks = 2
    bits = random_bits(rng, n_blocks, form.n_bits)
    coded = ldpc.encode(bits, form)
    assert coded.shape == (n_blocks, form.n_coded)
    # The code's own rate is the lowest.
    parity = np.diff(form.ends) - form.shares
    assert form.n_coded == room or np.all(parity == form.code.n - form.code.k)
    assert form.n_coded >= least
    assert form.shares.sum() == form.n_bits
    assert np.ptp(form.shares) <= 1
    llr = (100 - 200 * coded.astype(np.int16)).astype(np.int16)
    assert np.array_equal(decoded(llr, form, ldpc.new_workspace()), bits), seed


@law(40)
@given(
    st.integers(1, 500),
    st.sampled_from(RATES),
    st.floats(0, 1),
    st.floats(0, 12),
    st.integers(0, 2**32 - 1),
)
def test_blocks_are_coded_and_decoded_as_the_reference_does(n_bytes, rate, more, ebn0_db, seed):
    """Includes blocks whose signs are already a codeword, which are not decoded."""
    rng = np.random.default_rng(seed)
    form = segmentation(8 * n_bytes, rate, round(least_coded(8 * n_bytes, rate) * (1 + more)))
    bits, most = random_bits(rng, 1, form.n_bits), 12
    coded = ldpc.encode(bits, form)
    assert np.array_equal(coded, reference.encode_blocks(bits, form)), seed
    llr = noisy(rng, coded, ebn0_db, rate)
    found = np.unpackbits(ldpc.decode(llr, form, ldpc.new_workspace(), most), axis=1)
    assert np.array_equal(found, reference.decode_blocks(llr, form, most)), seed


@law()
@given(st.lists(st.integers(0, 100), max_size=20), st.integers(0, 2**32 - 1))
def test_signs_become_words_and_words_octets(sizes, seed):
    rng = np.random.default_rng(seed)
    values = rng.integers(-3, 4, sum(sizes)).astype(np.int16)
    words = np.zeros(sum(sizes) // 64 + 2, np.uint64)
    at = 0
    for n in sizes:
        words_of_bits.put_signs(values, at, n, words, at)
        at += n
    octets = np.empty(-(-at // 8), np.uint8)
    words_of_bits.to_octets(words, octets)
    assert np.array_equal(octets, np.packbits(values < 0))
    copied = np.zeros_like(words)
    at = 0
    for n in (min(n, 64) for n in sizes):
        words_of_bits.put(copied, at, np.uint64(words_of_bits.get(words, at, n)), n)
        at += n
    assert np.array_equal(
        np.unpackbits(copied.view(np.uint8), bitorder="little")[:at], values[:at] < 0
    )


def test_the_fewest_and_shortest_codewords_are_taken():
    found = {n: segmentation(n, RATES[0], 2 * n) for n in (8, 324, 325, 648, 649, 972, 973, 1945)}
    assert {n: (form.n_codewords, form.code.z) for n, form in found.items()} == {
        8: (1, 27), 324: (1, 27), 325: (1, 54), 648: (1, 54), 649: (1, 81), 972: (1, 81),
        973: (2, 54), 1945: (3, 54 + 27),
    }  # fmt: skip


@pytest.mark.slow
@pytest.mark.soak
@pytest.mark.parametrize(
    ("n_bytes", "rate", "ebn0_db"),
    [
        (64, RATES[0], 2.3),
        (220, RATES[0], 2.1),
        (220, RATES[1], 2.8),
        (220, RATES[2], 3.5),
        (220, RATES[3], 4.5),
        (1500, RATES[0], 2.2),
    ],
)
def test_it_bears_noise_near_its_threshold(n_bytes, rate, ebn0_db):
    """At most 1 % of blocks are lost; with two decibels less, almost all."""
    form = segmentation(8 * (n_bytes + 4), rate, least_coded(8 * (n_bytes + 4), rate))
    rng = np.random.default_rng(SEED)
    work = ldpc.new_workspace()
    rounds = []
    for _ in range(often(1)):
        bits = random_bits(rng, 1000 if n_bytes < 1000 else 300, form.n_bits)
        coded = ldpc.encode(bits, form)
        llrs = [noisy(rng, coded, at_db, rate) for at_db in (ebn0_db, ebn0_db - 2)]
        rounds.append([np.any(decoded(llr, form, work) != bits, axis=1).mean() for llr in llrs])
    lost = np.mean(rounds, axis=0)
    assert lost[0] <= 0.01, SEED
    assert lost[1] > 0.9, SEED


def test_what_cannot_be_decoded_ends_in_time_and_harms_nothing_after_it():
    form = segmentation(1792, RATES[0], 3584)
    rng, work = np.random.default_rng(SEED), ldpc.new_workspace()
    bits = random_bits(rng, 1, form.n_bits)
    llr = noisy(rng, ldpc.encode(bits, form), 4.0, RATES[0])
    for wrong in (np.zeros_like(llr), -llr, np.full_like(llr, -511), np.full_like(llr, -32768)):
        ldpc.decode(wrong, form, work)
        assert np.array_equal(decoded(llr, form, work), bits)
