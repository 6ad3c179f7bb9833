"""How long a burst is and which symbols hold which PDU."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

from phy import header, preamble
from phy.crc import CRC32_SIZE
from phy.mcs import MCS_TABLE, Mcs
from phy.numerology import Numerology
from phy.segmentation import Segmentation, least_coded, segmentation


@dataclass(frozen=True)
class BurstLayout:
    """A burst of `n_pdus` PDUs of `pdu_bytes` each, whose coded bits are contiguous."""

    grid: Numerology
    mcs: Mcs
    n_pdus: int
    pdu_bytes: int

    @cached_property
    def block_bytes(self) -> int:
        """Bytes of a PDU with its CRC-32."""
        return self.pdu_bytes + CRC32_SIZE

    @cached_property
    def form(self) -> Segmentation:
        """How a PDU is coded: with as much parity as the burst's symbols have room for."""
        n_bits = 8 * self.block_bytes
        room = self.n_symbols * self.symbol_bits // self.n_pdus
        return segmentation(n_bits, self.mcs.rate, room)

    @cached_property
    def coded_bits(self) -> int:
        """Coded bits of one PDU, including all parity."""
        return self.form.n_coded

    @cached_property
    def least_bits(self) -> int:
        """Coded bits of one PDU at exactly the rate of its MCS."""
        return least_coded(8 * self.block_bytes, self.mcs.rate)

    @cached_property
    def symbol_bits(self) -> int:
        """Coded bits of one OFDM symbol."""
        return self.grid.n_data * self.mcs.modulation.bits

    @cached_property
    def n_symbols(self) -> int:
        """Number of payload symbols of the burst."""
        return -(-self.n_pdus * self.least_bits // self.symbol_bits)

    @cached_property
    def n_samples(self) -> int:
        """Number of samples of the whole burst, preamble and header included."""
        n_symbols = header.n_symbols(self.grid) + self.n_symbols
        return preamble.length(self.grid) + n_symbols * self.grid.n_symbol

    def symbols_through(self, n_pdus: int) -> int:
        """Number of payload symbols needed to decode the first `n_pdus` PDUs."""
        return -(-n_pdus * self.coded_bits // self.symbol_bits)


@lru_cache(maxsize=256)
def layout(grid: Numerology, mcs: int, n_pdus: int, pdu_bytes: int) -> BurstLayout:
    """Compute the layout of a burst. Raises ValueError for values that no header can express."""
    for name, value, low, high in (
        ("MCS", mcs, 0, len(MCS_TABLE) - 1),
        ("PDUs in a burst", n_pdus, 1, header.MAX_PDUS),
        ("bytes of a PDU", pdu_bytes, 1, header.MAX_PDU_BYTES),
    ):
        if not low <= value <= high:
            raise ValueError(f"{name}: got {value}; allowed: {low} to {high}")
    return BurstLayout(grid, MCS_TABLE[mcs], n_pdus, pdu_bytes)


def most_pdus(grid: Numerology, mcs: int, pdu_bytes: int, n_samples: int) -> int:
    """Number of PDUs that fit in a burst of at most `n_samples`; at least 1, at most 63."""
    one = layout(grid, mcs, 1, pdu_bytes)
    fixed = preamble.length(grid) + header.n_symbols(grid) * grid.n_symbol
    symbols = max(0, n_samples - fixed) // grid.n_symbol
    return max(1, min(header.MAX_PDUS, symbols * one.symbol_bits // one.least_bits))
