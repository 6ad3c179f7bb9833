"""Simulates what happens to a PDU between two nodes, with a seeded random generator."""

from random import Random
from typing import NamedTuple

from sdrlinkd.config import DirectParams


class Arrival(NamedTuple):
    """A PDU as it arrives, `delay_s` after it left."""

    delay_s: float
    data: bytes


class Impairment:
    """Loses, delays, reorders, duplicates and corrupts PDUs, and counts each effect."""

    def __init__(self, params: DirectParams, rng: Random) -> None:
        self._params = params
        self._rng = rng
        self._clean = not (
            params.loss or params.delay_s or params.jitter_s or params.duplicate or params.corrupt
        )
        self.counters = {"lost": 0, "duplicated": 0, "corrupted": 0}

    def arrivals(self, data: bytes) -> list[Arrival]:
        """The copies of a PDU that arrive, with their delays and content; empty if it is lost."""
        if self._clean:
            return [Arrival(0.0, data)]
        params, chance = self._params, self._rng.random
        if chance() < params.loss:
            self.counters["lost"] += 1
            return []
        copies = 1
        if chance() < params.duplicate:
            self.counters["duplicated"] += 1
            copies = 2
        return [
            Arrival(params.delay_s + chance() * params.jitter_s, self._maybe_flip(data))
            for _ in range(copies)
        ]

    def _maybe_flip(self, data: bytes) -> bytes:
        if self._rng.random() >= self._params.corrupt:
            return data
        self.counters["corrupted"] += 1
        bit = self._rng.randrange(8 * len(data))
        flipped = bytearray(data)
        flipped[bit // 8] ^= 0x80 >> bit % 8
        return bytes(flipped)
