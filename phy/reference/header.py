"""Header: encodes and decodes a burst's MCS, PDUs and network.

    mcs 4 · PDUs 6 · PDU length 11 · network 3 · CRC-8, then 6 zeros, rate 1/2: 76 bits

The coded bits are repeated from the first on until the header's BPSK symbols are full.
"""

import numpy as np
from numpy.typing import NDArray

from phy.crc import crc8
from phy.header import N_BITS, N_CANDIDATES, BurstHeader
from phy.mcs import MCS_TABLE
from phy.reference.viterbi import MAX_LLR, N_TAIL, decode, encode

WIDTHS = BurstHeader(mcs=4, n_pdus=6, pdu_bytes=11, network=3)
N_CODED = 2 * (N_BITS + N_TAIL)


def header_bits(header: BurstHeader, n_coded: int) -> NDArray[np.uint8]:
    """Encode a header; the coded bits repeat from the first on up to `n_coded`."""
    text = "".join(f"{value:0{width}b}" for value, width in zip(header, WIDTHS, strict=True))
    fields = int(text, 2).to_bytes(3, "big")
    octets = np.frombuffer(fields + bytes([crc8(fields)]), np.uint8)
    return np.resize(encode(np.unpackbits(octets)), n_coded)


def folded(llr: NDArray[np.int16]) -> NDArray[np.int16]:
    """Add up the LLRs of each bit and its repetitions: `[n]` become `[76]`, at most ±MAX_LLR."""
    padded = np.zeros(-(-len(llr) // N_CODED) * N_CODED, np.int64)
    padded[: len(llr)] = llr
    total = padded.reshape(-1, N_CODED).sum(axis=0)
    return np.asarray(np.clip(total, -MAX_LLR, MAX_LLR), np.int16)


def parse_header(llr: NDArray[np.int16]) -> BurstHeader | None:
    """Decode a header from LLRs `[76]`: the first of the eight likeliest words that is valid.

    None: each word has a wrong CRC-8 or an invalid field.
    """
    for bits in decode(llr, N_CANDIDATES):
        header = checked(np.packbits(bits[:N_BITS]).tobytes())
        if header is not None:
            return header
    return None


def checked(octets: bytes) -> BurstHeader | None:
    """Decode four octets as a header; None if the CRC-8 is wrong or a field is invalid."""
    if crc8(octets[:3]) != octets[3]:
        return None
    rest, values = int.from_bytes(octets[:3], "big"), []
    for width in reversed(WIDTHS):
        values.append(rest % (1 << width))
        rest >>= width
    header = BurstHeader(*reversed(values))
    can_be = header.mcs < len(MCS_TABLE) and header.n_pdus > 0 and header.pdu_bytes > 0
    return header if can_be else None
