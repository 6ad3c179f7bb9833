"""The burst header: what follows, in 38 bits on two BPSK symbols.

mcs 4, PDUs 6, PDU length 11, network 3, CRC-8, 6 tail zeros; K=7 rate 1/2; the first 20 of the 76
coded bits once more make 96.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy.convolutional import HALF, CodeRate, ViterbiWorkspace, decode, encode
from phy.crc import crc8
from phy.mcs import MCS_TABLE

N_SYMBOLS = 2
N_BITS = 32
MAX_PDUS = 63
MAX_PDU_BYTES = 2047
N_NETWORKS = 8

CODE: CodeRate = HALF


class BurstHeader(NamedTuple):
    """MCS index, number of PDUs, bytes of each, and the network they belong to."""

    mcs: int
    n_pdus: int
    pdu_bytes: int
    network: int


def header_bits(header: BurstHeader, n_coded: int) -> NDArray[np.uint8]:
    """The coded bits of a header `[n_coded]`."""
    mcs, n_pdus, pdu_bytes, network = header
    fields = (mcs << 20 | n_pdus << 14 | pdu_bytes << 3 | network).to_bytes(3, "big")
    data = np.frombuffer(fields + bytes([crc8(fields)]), np.uint8)
    return np.resize(encode(data[None, :], CODE)[0], n_coded)


def parse_header(llr: NDArray[np.int16], workspace: ViterbiWorkspace) -> BurstHeader | None:
    """The header that LLRs `[n_coded]` tell; None when its check fails or it makes no sense."""
    n = CODE.n_coded(N_BITS)
    folded = llr[:n] // 2
    folded[: len(llr) - n] += llr[n:] // 2
    data = decode(folded[None, :], N_BITS // 8, CODE, workspace).tobytes()
    if crc8(data[:3]) != data[3]:
        return None
    fields = int.from_bytes(data[:3], "big")
    header = BurstHeader(fields >> 20, fields >> 14 & 0x3F, fields >> 3 & 0x7FF, fields & 7)
    sensible = header.mcs < len(MCS_TABLE) and header.n_pdus and header.pdu_bytes
    return header if sensible else None
