"""Finds the bursts of a growing recording, and describes in words how each was received."""

from collections import deque
from collections.abc import Callable, Iterable

import phy
from backends import GAP_LABEL, Annotation, Samples
from sdrlinkd.iq.recording import MAX_FREQUENCY

PIECE = 1 << 16
LEAST = 1 << 14
"""Fewest samples that are searched while more may come."""


class BurstFinder:
    """Searches a recording for bursts by `read(first, n)`, behind its writer; for one thread."""

    def __init__(
        self,
        read: Callable[[int, int], Samples],
        rate_hz: float,
        frequency_hz: float,
        network: int | None,
        grid: phy.Numerology,
    ) -> None:
        self._read = read
        self._rate_hz, self._frequency_hz = rate_hz, frequency_hz
        self._grid = grid
        self._receiver = phy.Receiver(network, MAX_FREQUENCY, grid)
        self._gaps: deque[tuple[int, int]] = deque()
        self.next_index = 0
        """Index of the first sample that was not searched yet."""
        self.annotations: list[Annotation] = []
        self.n_bursts = 0

    @property
    def n_good(self) -> int:
        """Number of PDUs with a correct CRC."""
        return self._receiver.counters["pdus_good"]

    @property
    def n_bad(self) -> int:
        """Number of PDUs with a wrong CRC."""
        return self._receiver.counters["pdus_bad"]

    def miss(self, start: int, n: int, reason: str) -> None:
        """Note that `n` samples from `start` on are missing."""
        self._gaps.append((start, n))
        told = f"{reason}: {n} samples, {1e3 * n / self._rate_hz:.3f} ms"
        self.annotations.append(Annotation(start, n, GAP_LABEL, told))

    def look(self, end: int, least: int = 1) -> bool:
        """Search the next piece before `end`; False if there are fewer than `least` samples."""
        first = self.next_index
        if first + least > end:
            return False
        start, missing = self._gaps[0] if self._gaps else (end, 0)
        if start <= first:
            self._gaps.popleft()
            self.next_index = start + missing
            self._note(self._receiver.gap(missing))
            return True
        samples = self._read(first, min(PIECE, start - first, end - first))
        self.next_index = first + len(samples)
        self._note(self._receiver.push(samples))
        return len(samples) > 0

    def finish(self, end: int) -> None:
        """End the search where the recording ends."""
        self._note(self._receiver.flush())
        self.annotations = [
            each._replace(n=min(each.n, end - each.start)) for each in self.annotations
        ]

    def _note(self, events: Iterable[phy.Event]) -> None:
        for event in events:
            if isinstance(event, phy.BurstOver):
                self.n_bursts += 1
                self.annotations.append(self._annotation(event))

    def _annotation(self, over: phy.BurstOver) -> Annotation:
        burst, grid, rate_hz = over.burst, self._grid, self._rate_hz
        start = max(0, burst.start)
        length = phy.layout(grid, burst.mcs, burst.n_pdus, burst.pdu_bytes).n_samples
        middle = self._frequency_hz + burst.cfo * rate_hz
        half = (grid.edge + 0.5) * rate_hz / grid.n_fft
        label = "foreign burst" if over.ending == "foreign" else "burst"
        return Annotation(
            start,
            burst.start + length - start,
            label,
            _words(over, rate_hz),
            (round(middle - half, 1), round(middle + half, 1)),
        )


def _words(over: phy.BurstOver, rate_hz: float) -> str:
    burst = over.burst
    pdus = f"{over.n_good} good, {burst.n_pdus - over.n_good} bad"
    if over.ending == "foreign":
        pdus = f"{burst.n_pdus}, not decoded"
    said = (
        f"{phy.MCS_TABLE[burst.mcs].name}, PDUs of {burst.pdu_bytes} B: {pdus}, "
        f"SNR {burst.snr_db:.1f} dB, CFO {round(burst.cfo * rate_hz):+d} Hz, "
        f"EVM {burst.evm_db:.1f} dB, {burst.rssi_dbfs:.1f} dBFS, network {burst.network}"
    )
    return said if over.ending in ("whole", "foreign") else f"{said}, {over.ending}"
