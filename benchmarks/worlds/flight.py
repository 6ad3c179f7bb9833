"""A burst on its way, and the loss probability of its parts at each receiver.

White noise only. Concurrent transmissions also count as noise: their powers add up. Each part of a
codeword carries the information that a subcarrier gives at that part's SINR. The codeword fails as
often as at the constant SNR with the same mean information; a PDU fails with any of its codewords.
"""

import math
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import phy
from backends import Hop


class BurstShape(NamedTuple):
    """Times in s from a burst's first sample.

    `head_s`: end of preamble and header. `pdus`: start and end of each PDU's symbols, which contain
    `n_codewords` in sequence.
    """

    mcs: int
    pdu_bytes: int
    n_codewords: int
    airtime_s: float
    head_s: float
    pdus: tuple[tuple[float, float], ...]


@dataclass(slots=True, eq=False)
class Flight:
    """A burst on the air; for each node that it reaches: arrival, strength and random numbers."""

    sender: int
    start_s: float
    over_s: float
    """Time in s at which it has passed all nodes."""
    shape: BurstShape
    hops: dict[int, Hop]
    arrives: dict[int, float]
    draws: dict[int, list[float]]
    near: list["Flight"] = field(default_factory=list)
    """Other bursts that are on the air somewhere at the same time."""
    found: dict[int, bool] = field(default_factory=dict)

    @property
    def end_s(self) -> float:
        """Time at which its last sample leaves."""
        return self.start_s + self.shape.airtime_s


@lru_cache(maxsize=256)
def burst_shape(
    rate_hz: float,
    mcs: int,
    n_pdus: int,
    pdu_bytes: int,
    grid: phy.Numerology = phy.OFDM_64_16,
) -> BurstShape:
    """Times of a burst as the modem sends it. Raises ValueError for what no header can express."""
    plan = phy.layout(grid, mcs, n_pdus, pdu_bytes)
    symbol, head = plan.grid.n_symbol, plan.n_samples - plan.n_symbols * plan.grid.n_symbol
    firsts = [i * plan.coded_bits // plan.symbol_bits for i in range(n_pdus)]
    lasts = [plan.symbols_through(i + 1) for i in range(n_pdus)]
    pdus = tuple(
        ((head + symbol * first) / rate_hz, (head + symbol * last) / rate_hz)
        for first, last in zip(firsts, lasts, strict=True)
    )
    airtime_s, head_s = plan.n_samples / rate_hz, head / rate_hz
    return BurstShape(mcs, pdu_bytes, plan.form.n_codewords, airtime_s, head_s, pdus)


# As measured with the modem (tests/lab/test_burst_channel.py).
_STRANGE = 1.5

lost_rate = lru_cache(maxsize=4096)(phy.pdu_lost_rate)
found_rate = lru_cache(maxsize=4096)(phy.burst_found_rate)


def _parts(flight: Flight, node: int, begin: float, end: float) -> list[tuple[float, float]]:
    """(share, power of all noise relative to the receiver's own) of the parts between two times."""
    others = []
    for each in flight.near:
        at = each.arrives.get(node, math.inf)
        over = at + each.shape.airtime_s
        if at < end and begin < over:
            others.append((at, over, 10 ** (each.hops[node].snr_db / 10)))
    cuts = {begin, end, *(t for each in others for t in each[:2] if begin < t < end)}
    return [
        (
            (last - first) / (end - begin),
            1 + sum(power for at, over, power in others if at <= first and last <= over),
        )
        for first, last in pairwise(sorted(cuts))
    ]


def head_snr_db(flight: Flight, node: int, at: float) -> float:
    """SNR by the mean noise until the end of the header."""
    snr_db = flight.hops[node].snr_db
    if not flight.near:
        return snr_db
    parts = _parts(flight, node, at, at + flight.shape.head_s)
    return snr_db - decibel(sum(share * noise for share, noise in parts))


def lost_rate_in(flight: Flight, node: int, begin: float, end: float) -> float:
    """Loss probability of a PDU between two times; interference may hit single codewords."""
    shape, kept = flight.shape, 1.0
    n = shape.n_codewords
    for number in range(n):
        first = begin + (end - begin) * number / n
        parts = _parts(flight, node, first, first + (end - begin) / n)
        lost = lost_rate(shape.mcs, _mean_snr_db(flight, node, parts), shape.pdu_bytes)
        kept *= (1 - lost) ** (1 / n)
    return 1 - kept


def _mean_snr_db(flight: Flight, node: int, parts: list[tuple[float, float]]) -> float:
    """The constant SNR with the same mean information per subcarrier as the given parts.

    Interference counts more than the same power of white noise: a receiver has only four pilots in
    a symbol to detect it.
    """
    snr_db = flight.hops[node].snr_db
    if parts == [(1.0, 1.0)]:
        return snr_db
    snr, most = 10 ** (snr_db / 10), phy.MCS_TABLE[flight.shape.mcs].modulation.bits
    information = sum(
        share * min(math.log2(1 + snr / (1 + _STRANGE * (noise - 1))), most)
        for share, noise in parts
    )
    return decibel(math.expm1(information * math.log(2)))


def decibel(ratio: float) -> float:
    """A ratio in dB, rounded to keep the table of errors short."""
    return round(10 * math.log10(ratio), 2)
