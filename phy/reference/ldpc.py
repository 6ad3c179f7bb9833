"""LDPC code: encodes and decodes the blocks of PDUs.

A parity-check matrix consists of Z × Z blocks, each zero or the identity shifted right by s: check
z of a block row takes bit (z + s) mod Z of the block column (IEEE 802.11-2020, Annex F; `phy.ldpc`
has the tables). So a codeword is an array `[24, Z]`, and the Z checks of a block row are one vector
operation for each of its blocks.
"""

from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from phy.segmentation import MAX_ITERATIONS, QuasiCyclic, Segmentation

Bits = NDArray[np.uint8]

SURE = 4000
"""LLR of a bit that was not sent because it is 0."""
MAX_POSTERIOR = 8000
MAX_MAGNITUDE = 2000
"""Limit of magnitudes."""
WEIGHT = 14
"""Factor of messages, in sixteenths (Chen and Fossorier 2002)."""


@cache
def taken(code: QuasiCyclic) -> NDArray[np.int64]:
    """The bit of its block column that each check takes on edge e, in row e `[edges, Z]`."""
    return (np.arange(code.z) + code.shifts[:, None]) % code.z


def parity(information: Bits, code: QuasiCyclic) -> Bits:
    """Compute the parity `[n − k]` of information `[k]`.

        λ_r = Σ_c P^s u_c;  p_0 = Σ_r λ_r;  p_1 = λ_0 + P¹ p_0;  p_{r+1} = p_r + λ_r (+ p_0)

    λ_r is the contribution of the information to the checks of block row r. Parity column 0 has
    blocks with shift 1 in the first and the last row and with 0 in row `middle`, so that only p_0
    remains in the sum of all rows; the other columns form a staircase. The + p_0 belongs to row
    `middle`.
    """
    n_rows = len(code.base)
    u = information.reshape(-1, code.z)
    # The parity columns come last in every row.
    edges = np.flatnonzero(code.columns < len(u))
    begins = np.searchsorted(edges, code.row_ends[:-1])
    bits = u[code.columns[edges, None], taken(code)[edges]]
    sums = np.bitwise_xor.reduceat(bits, begins)
    p = np.empty((n_rows, code.z), np.uint8)
    p[0] = np.bitwise_xor.reduce(sums)
    p[1] = sums[0] ^ np.roll(p[0], -1)
    for row in range(1, n_rows - 1):
        p[row + 1] = p[row] ^ sums[row]
        if row == code.middle:
            p[row + 1] ^= p[0]
    return p.reshape(-1)


def encode_blocks(blocks: Bits, form: Segmentation) -> Bits:
    """Encode blocks of bits `[blocks, n_bits]` to coded bits `[blocks, n_coded]`.

    Each codeword carries its share of the block as information, followed by zeros that are not
    sent, and then as much of its parity, from the front, as the burst has room for.
    """
    code = form.code
    out = np.empty((len(blocks), form.n_coded), np.uint8)
    for block, coded in zip(blocks, out, strict=True):
        at = 0
        for share, (begin, end) in zip(form.shares, pairwise(form.ends), strict=True):
            information = np.zeros(code.k, np.uint8)
            information[:share] = block[at : at + share]
            coded[begin : begin + share] = information[:share]
            coded[begin + share : end] = parity(information, code)[: end - begin - share]
            at += share
    return out


def decode_blocks(
    llr: NDArray[np.int16], form: Segmentation, max_iterations: int = MAX_ITERATIONS
) -> Bits:
    """Decode LLRs `[blocks · n_coded]`, positive for 0, to bits `[blocks, n_bits]`.

    If the signs of the LLRs already form a codeword, it is the likeliest and is taken as it is.
    """
    code = form.code
    blocks = []
    for of_block in llr.reshape(-1, form.n_coded):
        decided = []
        for share, (begin, end) in zip(form.shares, pairwise(form.ends), strict=True):
            sent, n_parity = of_block[begin:end], end - begin - share
            signs = np.zeros(code.k, np.uint8)
            signs[:share] = sent[:share] < 0
            if np.any(parity(signs, code)[:n_parity] != (sent[share:] < 0)):
                word = np.zeros(code.n, np.int16)
                word[:share], word[share : code.k] = sent[:share], SURE
                word[code.k : code.k + n_parity] = sent[share:]
                _, posteriors = decode_codeword(word, code, max_iterations)
                signs = (posteriors.reshape(-1)[: code.k] < 0).astype(np.uint8)
            decided.append(signs[:share])
        blocks.append(np.concatenate(decided))
    return np.array(blocks, np.uint8).reshape(-1, form.n_bits)


def decode_codeword(
    llr: NDArray[np.int16], code: QuasiCyclic, max_iterations: int
) -> tuple[int, NDArray[np.int32]]:
    """Layered min-sum decoding; (iterations until all checks held or 0, posteriors `[24, Z]`).

        rest = posterior − message;  message' = f(rest of the others);  posterior' = rest + message'

    It visits the block rows in turn, and each row uses the results of the one before (Hocevar
    2004). If a bit's message to a check has changed its sign since the last one, it counts as 0
    this time (Savin 2008).
    """
    posteriors = llr.reshape(-1, code.z).astype(np.int32)
    messages, told = np.zeros((2, len(code.columns), code.z), np.int32)
    takes = taken(code)
    for iteration in range(max_iterations):
        all_hold = True
        for first, last in pairwise(code.row_ends):
            row = slice(first, last)
            bits = (code.columns[row, None], takes[row])
            all_hold &= not np.any(np.logical_xor.reduce(posteriors[bits] < 0))
            rest = posteriors[bits] - messages[row]
            told[row] = np.where(rest * np.sign(told[row]) < 0, 0, rest)
            messages[row] = check_messages(told[row])
            posteriors[bits] = np.clip(rest + messages[row], -MAX_POSTERIOR, MAX_POSTERIOR)
        if all_hold:
            return iteration + 1, posteriors
    return 0, posteriors


def check_messages(told: NDArray[np.int32]) -> NDArray[np.int32]:
    """Messages of each check to each of its bits, from what its other bits told it.

    Both are `[bits, checks]`.

        message_i = 14/16 · min_{j ≠ i} |told_j| · Π_{j ≠ i} sign told_j

    Two minima serve all bits: the least of all, and the second least for the bit that has the
    least. A bit that tells 0 counts as positive.
    """
    size = np.abs(told)
    least, second = np.sort(size, axis=0)[:2]
    others_least = np.where(size == least, second, least)
    value = (np.minimum(others_least, MAX_MAGNITUDE) * WEIGHT + 8) >> 4
    is_negative = np.logical_xor.reduce(told < 0) ^ (told < 0)
    messages: NDArray[np.int32] = np.where(is_negative, -value, value)
    return messages
