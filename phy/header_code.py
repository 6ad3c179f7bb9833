"""The code of the burst header: its coded bits, and the header in received ones."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from phy.convolutional import HALF, CodeRate, decode_list, encode
from phy.crc import crc8
from phy.header import N_BITS, N_CANDIDATES, BurstHeader
from phy.mcs import MCS_TABLE

CODE: CodeRate = HALF


def header_bits(header: BurstHeader, n_coded: int) -> NDArray[np.uint8]:
    """The coded bits of a header `[n_coded]`, repeated to fill `n_coded`."""
    mcs, n_pdus, pdu_bytes, network = header
    fields = (mcs << 20 | n_pdus << 14 | pdu_bytes << 3 | network).to_bytes(3, "big")
    data = np.frombuffer(fields + bytes([crc8(fields)]), np.uint8)
    return np.resize(encode(data[None, :], CODE)[0], n_coded)


def parse_header(likeliest: NDArray[np.uint8], llr: NDArray[np.int16]) -> BurstHeader | None:
    """The header in `likeliest` `[4]`, or in another likely word of its LLRs `[76]`, or None."""
    header = checked(likeliest.tobytes())
    if header is not None:
        return header
    words = decode_list(llr, N_BITS // 8, N_CANDIDATES)
    candidates = (checked(octets.tobytes()) for octets in words)
    return next((header for header in candidates if header is not None), None)


@lru_cache(maxsize=256)
def checked(data: bytes) -> BurstHeader | None:
    """The header in four octets; None if its check fails or a field is invalid."""
    if crc8(data[:3]) != data[3]:
        return None
    fields = int.from_bytes(data[:3], "big")
    header = BurstHeader(fields >> 20, fields >> 14 & 0x3F, fields >> 3 & 0x7FF, fields & 7)
    sensible = header.mcs < len(MCS_TABLE) and header.n_pdus and header.pdu_bytes
    return header if sensible else None
