"""Which preambles a receiver acquires, which headers it believes, and how much air they claim."""

from collections import Counter, deque

from phy.expected import Expected, OtherLink
from phy.header import N_NETWORKS, BurstHeader
from phy.layout import BurstLayout
from phy.quality import BurstQuality, Claim

MOST_OTHERS = 64
"""Headers of other links that are remembered."""
OFTEN = 3
"""Headers after which another link is believed: a single one may be noise."""


class Screening:
    """Keeps false preambles and false headers from costing a receiver its time.

    Time is counted in samples, so that the result does not depend on how they are chunked. Without
    `expected`, every header is believed. Raises ValueError for an impossible network.
    """

    def __init__(self, network: int | None, expected: Expected | None, start: int) -> None:
        if network is not None and not 0 <= network < N_NETWORKS:
            raise ValueError(f"network: got {network}; allowed: 0 to {N_NETWORKS - 1}")
        self._network = network
        self._expected = expected
        self._left = 0.0 if expected is None else float(expected.misses)
        self._at = start
        self._others: deque[tuple[int, OtherLink]] = deque(maxlen=MOST_OTHERS)

    def allows(self, index: int) -> bool:
        """Whether the peak at `index` may be acquired, by the budget for acquisitions that fail."""
        expected = self._expected
        if expected is None:
            return True
        grown = max(0, index - self._at) / expected.every
        self._left = min(self._left + grown, float(expected.misses))
        self._at = max(self._at, index)
        return self._left >= 1.0

    def missed(self) -> None:
        """Note that an acquisition has brought no PDU."""
        self._left -= 1.0

    def is_foreign(self, header: BurstHeader) -> bool:
        """Whether a header names another network than ours."""
        return self._network is not None and header.network != self._network

    def note_other(self, header: BurstHeader, index: int) -> None:
        """Remember a header at `index` that is of another network, or has another PDU length."""
        expected = self._expected
        if self.is_foreign(header) or (expected and header.pdu_bytes != expected.pdu_bytes):
            self._others.append((index, OtherLink(header.network, header.pdu_bytes)))

    def others(self, since: int) -> list[OtherLink]:
        """Links other than ours that were heard often since index `since`, the most often first."""
        heard = Counter(other for index, other in tuple(self._others) if index >= since)
        return [other for other, n in heard.most_common() if n >= OFTEN]

    def refuses(self, header: BurstHeader, plan: BurstLayout) -> bool:
        """Whether no burst of our network can have this header, which announces `plan`."""
        expected = self._expected
        if expected is None or self.is_foreign(header):
            return False
        return header.pdu_bytes != expected.pdu_bytes or plan.n_samples > expected.longest

    def claim(self, quality: BurstQuality, end: int) -> Claim:
        """The air of a burst that ends at index `end`; of no burst more than our longest."""
        if self._expected is not None:
            end = min(end, quality.start + self._expected.longest)
        return Claim(quality.start, end, quality.snr_db)
