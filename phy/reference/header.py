"""The header tells a burst's MCS, PDUs and network; it is coded and read again here.

    mcs 4 · PDUs 6 · PDU length 11 · network 3 · CRC-8, then 6 zeros, rate 1/2: 76 bits

The first coded bits are sent once more until the header's BPSK symbols are full.
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
    """A header becomes its coded bits, repeated from the first on up to `n_coded`."""
    text = "".join(f"{value:0{width}b}" for value, width in zip(header, WIDTHS, strict=True))
    fields = int(text, 2).to_bytes(3, "big")
    octets = np.frombuffer(fields + bytes([crc8(fields)]), np.uint8)
    return np.resize(encode(np.unpackbits(octets)), n_coded)


def folded(llr: NDArray[np.int16]) -> NDArray[np.int16]:
    """The LLRs of a bit and of its repetitions add up: `[n]` become `[76]`, at most ±MAX_LLR."""
    padded = np.zeros(-(-len(llr) // N_CODED) * N_CODED, np.int64)
    padded[: len(llr)] = llr
    total = padded.reshape(-1, N_CODED).sum(axis=0)
    return np.asarray(np.clip(total, -MAX_LLR, MAX_LLR), np.int16)


def parse_header(llr: NDArray[np.int16]) -> BurstHeader | None:
    """The header behind LLRs `[76]` is the first of the eight likeliest words that is one.

    None says that the CRC-8 of each is wrong, or that what they tell makes no sense.
    """
    for bits in decode(llr, N_CANDIDATES):
        header = checked(np.packbits(bits[:N_BITS]).tobytes())
        if header is not None:
            return header
    return None


def checked(octets: bytes) -> BurstHeader | None:
    """Four octets are a header when their CRC-8 is right and each field can be; else None."""
    if crc8(octets[:3]) != octets[3]:
        return None
    rest, values = int.from_bytes(octets[:3], "big"), []
    for width in reversed(WIDTHS):
        values.append(rest % (1 << width))
        rest >>= width
    header = BurstHeader(*reversed(values))
    can_be = header.mcs < len(MCS_TABLE) and header.n_pdus > 0 and header.pdu_bytes > 0
    return header if can_be else None
