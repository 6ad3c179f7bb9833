"""The convolutional code: compared with the reference, its distances, and the union bound."""

from math import erfc, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phy.reference import viterbi
from phy.testing import convolutional
from tests.laws import law

SEED = 11
HALF, TWO_THIRDS = convolutional.HALF, convolutional.TWO_THIRDS
THREE_QUARTERS, MAX_LLR = convolutional.THREE_QUARTERS, convolutional.MAX_LLR
encode, decode = convolutional.encode, convolutional.decode
RATES = (HALF, TWO_THIRDS, THREE_QUARTERS)
WORK = convolutional.ViterbiWorkspace(8 * 2051 + 6)

every_rate = pytest.mark.parametrize("code", RATES, ids=lambda code: code.name)


def random_blocks(rng, n, n_bytes):
    return rng.integers(0, 256, (n, n_bytes), np.uint8)


def surely(coded, strength=100):
    """LLRs that clearly represent these bits."""
    return (strength * (1 - 2 * coded.astype(np.int16))).astype(np.int16)


def decode_one(llr, n_bytes, code):
    return decode(llr[None, :], n_bytes, code, WORK)[0]


def plain_viterbi(llr, n_bytes, pattern):
    """The reference's decoder; punctured bits carry no information."""
    n_steps = 8 * n_bytes + 6
    sent = np.flatnonzero(np.resize(pattern, 2 * n_steps))
    mother = np.zeros(2 * n_steps, np.int64)
    mother[sent] = llr
    return np.packbits(viterbi.decode(mother)[0, : 8 * n_bytes])


def test_the_encoder_is_the_references():
    data = random_blocks(np.random.default_rng(SEED), 3, 40)
    coded = encode(data, HALF)
    for row, block in zip(coded, data, strict=True):
        assert np.array_equal(row, viterbi.encode(np.unpackbits(block)))


@pytest.mark.parametrize(
    ("code", "kept"), [(TWO_THIRDS, (0, 1, 2)), (THREE_QUARTERS, (0, 1, 2, 5))]
)
def test_puncturing_is_the_standards(code, kept):
    """Figure 17-9: of A0 B0 A1 B1 (A2 B2), B1 (and A2) are not sent."""
    data = random_blocks(np.random.default_rng(SEED), 1, 33)
    mother = encode(data, HALF)[0]
    period = {TWO_THIRDS: 4, THREE_QUARTERS: 6}[code]
    wanted = [bit for i, bit in enumerate(mother) if i % period in kept]
    assert list(encode(data, code)[0]) == wanted
    assert code.n_coded(8 * 33) == len(wanted)


@law(60)
@given(st.binary(min_size=1, max_size=300), st.sampled_from(RATES))
def test_decoding_undoes_encoding(data, code):
    block = np.frombuffer(data, np.uint8)
    llr = surely(encode(block[None, :], code)[0])
    assert decode_one(llr, len(data), code).tobytes() == data


@every_rate
def test_the_longest_block(code):
    data = random_blocks(np.random.default_rng(SEED), 1, 2051)
    for strength in (1, MAX_LLR):
        llr = surely(encode(data, code)[0], strength)
        assert np.array_equal(decode_one(llr, 2051, code), data[0])


def test_the_free_distance_is_10():
    every_byte = np.arange(1, 256, dtype=np.uint8)[:, None]
    assert encode(every_byte, HALF).sum(axis=1).min() == 10


@pytest.mark.parametrize(("code", "n_errors"), [(HALF, 4), (TWO_THIRDS, 2), (THREE_QUARTERS, 2)])
def test_as_many_errors_as_the_distance_allows_are_corrected_anywhere(code, n_errors):
    rng = np.random.default_rng(SEED)
    data = random_blocks(rng, 300, 20)
    for block, coded in zip(data, encode(data, code), strict=True):
        first = rng.integers(0, len(coded) - 12)
        # Errors close together are the worst.
        wrong = first + rng.permutation(12)[:n_errors]
        coded[wrong] ^= 1
        assert np.array_equal(decode_one(surely(coded), 20, code), block)


def test_five_errors_inside_a_lightest_codeword_are_too_many():
    lightest = encode(np.array([[0, 1, 0]], np.uint8), HALF)[0]
    wrong = np.flatnonzero(lightest)
    assert len(wrong) == 10
    received = np.zeros_like(lightest)
    received[wrong[:6]] = 1
    assert decode_one(surely(received), 3, HALF).any()
    received[wrong[4:6]] = 0
    assert not decode_one(surely(received), 3, HALF).any()


@every_rate
@pytest.mark.parametrize("kind", ["noise", "random", "extremes", "zeros", "ties"])
def test_the_vector_decoder_agrees_with_the_reference(code, kind):
    rng = np.random.default_rng(SEED)
    for n_bytes in (1, 2, 17, 40):
        coded = encode(random_blocks(rng, 1, n_bytes), code)[0]
        noisy = surely(coded, 16) + rng.normal(0, 24, len(coded))
        llr = {
            "noise": np.clip(noisy, -MAX_LLR, MAX_LLR),
            "random": rng.integers(-MAX_LLR, MAX_LLR + 1, len(coded)),
            "extremes": rng.choice([-MAX_LLR, MAX_LLR], len(coded)),
            "zeros": np.zeros(len(coded)),
            "ties": rng.choice([-MAX_LLR, -1, 0, 0, 1, MAX_LLR], len(coded)),
        }[kind].astype(np.int16)
        wanted = plain_viterbi(llr, n_bytes, code.pattern)
        assert np.array_equal(decode_one(llr, n_bytes, code), wanted)


@pytest.mark.parametrize("start", [1, 31, 32, 63])
def test_a_block_that_seems_to_begin_in_another_state_is_still_decoded_from_state_0(start):
    """Full-scale LLRs for a path from another state must not beat those from state 0."""
    register = [start >> (5 - i) & 1 for i in range(6)][::-1]
    data = np.packbits([*register, 1, 0, *[0, 1] * 8])[None, :]
    llr = surely(encode(data, HALF)[0, 12:], MAX_LLR)
    llr = np.concatenate((llr, np.full(12, MAX_LLR, np.int16)))
    assert np.array_equal(decode_one(llr, 3, HALF), plain_viterbi(llr, 3, HALF.pattern))


def test_a_used_workspace_leaves_no_trace():
    rng = np.random.default_rng(SEED)
    work = convolutional.ViterbiWorkspace(8 * 60 + 6)
    long = encode(random_blocks(rng, 1, 60), HALF)
    data = random_blocks(rng, 1, 5)
    decode(surely(long, MAX_LLR), 60, HALF, work)
    llr = surely(encode(data, THREE_QUARTERS))
    assert np.array_equal(decode(llr, 5, THREE_QUARTERS, work), data)


@every_rate
def test_blocks_together_are_decoded_as_each_alone(code):
    rng = np.random.default_rng(SEED)
    coded = encode(random_blocks(rng, 9, 33), code)
    llr = np.clip(surely(coded, 16) + rng.normal(0, 20, coded.shape), -MAX_LLR, MAX_LLR)
    llr = llr.astype(np.int16)
    alone = [decode_one(each, 33, code) for each in llr]
    assert np.array_equal(decode(llr, 33, code, WORK), alone)
    assert decode(llr[:0], 33, code, WORK).shape == (0, 33)


def block_error_rate(es_no_db, n, n_bytes):
    """Block error rate in QPSK with known noise power and LLRs quantised like the demapper's."""
    rng = np.random.default_rng(SEED)
    no = 2 / 10 ** (es_no_db / 10)  # for ±1 on either axis
    data = random_blocks(rng, n, n_bytes)
    coded = encode(data, HALF)
    received = 1 - 2.0 * coded + sqrt(no / 2) * rng.standard_normal(coded.shape)
    llr = np.clip(8 * 4 * received / no, -MAX_LLR, MAX_LLR).astype(np.int16)
    return np.mean(np.any(decode(llr, n_bytes, HALF, WORK) != data, axis=1))


def union_bound(es_no_db, n_bits):
    """Upper bound of the block error rate, from the code's known distance spectrum."""
    paths = {10: 11, 12: 38, 14: 193, 16: 1331, 18: 7275, 20: 40406, 22: 234969}
    snr = 10 ** (es_no_db / 10)
    return n_bits * sum(n * 0.5 * erfc(sqrt(d * snr / 2)) for d, n in paths.items())


def test_one_block_of_64_bytes_in_a_hundred_is_lost_at_3_45_db():
    assert block_error_rate(3.45 - 0.4, 2000, 64) > 0.01 > block_error_rate(3.45 + 0.4, 2000, 64)


def test_block_errors_keep_the_union_bound():
    """Below the bound, but not by much: quantisation costs a few hundredths of a dB."""
    rate, bound = block_error_rate(3.45, 4000, 64), union_bound(3.45, 8 * 64)
    assert 0.5 * bound < rate < 1.3 * bound
