"""Lengths of bursts, and how many PDUs fit into one."""

import phy
from sdrlinkd.config import ModemParams

# Largest rounding error of a time, in samples.
ROUNDING = 1e-2


class Airtimes:
    """Lengths of bursts for one PDU size; bursts of several PDUs last at most `max_burst_s`."""

    def __init__(self, params: ModemParams, pdu_size: int) -> None:
        self._rate_hz = params.rate_hz
        self._grid = phy.GRIDS[params.grid]
        self._longest = round(params.max_burst_s * params.rate_hz)
        self._pdu_size = pdu_size

    def samples(self, mcs: int, n_pdus: int) -> int:
        """Length of a burst of `n_pdus` PDUs in samples; without any, it is a pulse."""
        if not n_pdus:
            return phy.N_PULSE
        return phy.layout(self._grid, mcs, n_pdus, self._pdu_size).n_samples

    def airtime_s(self, mcs: int, n_pdus: int) -> float:
        """Length of a burst of `n_pdus` PDUs in s."""
        return self.samples(mcs, n_pdus) / self._rate_hz

    def needed_snr_db(self) -> tuple[float, ...]:
        """The SNR in dB that each MCS needs for PDUs of this size."""
        return tuple(phy.needed_snr_db(mcs, self._pdu_size) for mcs in range(len(phy.MCS_TABLE)))

    @property
    def overhead_s(self) -> float:
        """Time in s of preamble, header, and the unused rest of the last symbol."""
        one = phy.layout(self._grid, 0, 1, self._pdu_size)
        return (one.n_samples - (one.n_symbols - 1) * one.grid.n_symbol) / self._rate_hz

    def most_pdus(self, mcs: int, airtime_s: float) -> int:
        """How many PDUs fit into a burst of at most `airtime_s`; 0 if none does."""
        given = airtime_s * self._rate_hz + ROUNDING
        if self.samples(mcs, 1) > given:
            return 0
        room = int(min(given, self._longest))
        return phy.most_pdus(self._grid, mcs, self._pdu_size, room)

    def shortest_s(self) -> tuple[float, ...]:
        """Length in s of a burst of one PDU, by MCS."""
        return tuple(self.airtime_s(mcs, 1) for mcs in range(len(phy.MCS_TABLE)))

    def longest_s(self) -> tuple[float, ...]:
        """Length in s of the longest burst, by MCS."""
        return tuple(
            self.airtime_s(mcs, self.most_pdus(mcs, float("inf")))
            for mcs in range(len(phy.MCS_TABLE))
        )
