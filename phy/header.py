"""The burst header: 38 bits about the payload on BPSK symbols, two of them on 64 subcarriers.

mcs 4, PDUs 6, PDU length 11, network 3, CRC-8, 6 tail zeros; K=7 rate 1/2. The 76 coded bits are
repeated from the first on until the symbols are full. `phy.header_code` encodes and decodes it.
"""

from typing import NamedTuple

from phy.numerology import Numerology

N_BITS = 32
N_CODED = 96
"""Minimum number of coded bits in a header."""
MAX_PDUS = 63
MAX_PDU_BYTES = 2047
N_NETWORKS = 8
N_CANDIDATES = 8
"""Number of code words to try when the likeliest fails its check."""


class BurstHeader(NamedTuple):
    """MCS index, number of PDUs, their size in bytes, and their network."""

    mcs: int
    n_pdus: int
    pdu_bytes: int
    network: int


def n_symbols(grid: Numerology) -> int:
    """Number of OFDM symbols in a header on `grid`."""
    return -(-N_CODED // grid.n_data)
