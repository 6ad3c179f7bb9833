"""The air itself: computes what each node's antenna receives from the others."""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from backends.air import Timeline
from backends.base import Samples, TxBurst
from backends.ether.world import AirParams, RadioParams, World
from backends.outstanding import GAP
from phy import Path, PathParams

NOISE_DBFS = -80.0
"""Noise of every receiver. A burst's SNR is its power above this."""
MARGIN = 16
"""Samples by which a burst may arrive early at most: filter skirts, rounding between clocks."""


LEAD = MARGIN + 1
"""Number of samples before its start at which a burst must be handed over."""


class Piece(NamedTuple):
    """The next `n` samples of a node: None for silence; `is_deaf`: the node does not hear them."""

    n: int
    samples: Samples | None
    is_deaf: bool


@dataclass
class _Node:
    radio: RadioParams
    rate_hz: float
    """The node's sample rate, as its own crystal makes it."""
    joined_at: float
    timeline: Timeline = field(default_factory=Timeline)
    next_index: int = 0
    free_from: int = 0
    deaf: list[tuple[int, int]] = field(default_factory=list)

    def index(self, t: float) -> int:
        return math.floor((t - self.joined_at) * self.rate_hz)

    def time(self, index: int) -> float:
        return self.joined_at + index / self.rate_hz


class Medium:
    """Nodes on one air, each with a sample count of its own that begins when it joins.

    Bursts that arrive at the same time add up. Random effects (fading, phases) are drawn for each
    pair of nodes from `seed`.
    """

    def __init__(self, air: AirParams, world: World, seed: int) -> None:
        self._air = air
        self._world = world
        self._seed = seed
        self._nodes: dict[int, _Node] = {}
        self._rngs: dict[tuple[int, int], np.random.Generator] = {}
        self.bursts = 0
        self.bursts_late = 0

    def join(self, node_id: int, radio: RadioParams, now: float) -> None:
        """Add a node whose index 0 is at the time `now`."""
        rate_hz = self._air.rate_hz * (1 + 1e-6 * radio.clock_ppm)
        self._nodes[node_id] = _Node(radio, rate_hz, now)

    def leave(self, node_id: int) -> None:
        """Remove a node; what it has sent still arrives."""
        self._nodes.pop(node_id, None)

    def time(self, node_id: int, index: int) -> float:
        """The time in s of a node's sample."""
        return self._nodes[node_id].time(index)

    def next_index(self, node_id: int) -> int:
        """Index of the node's first sample that has not been taken."""
        return self._nodes[node_id].next_index

    def send(self, node_id: int, burst: TxBurst) -> int | None:
        """Put a burst on the air; returns its start in the sender's count, None if too late."""
        node = self._nodes[node_id]
        turnaround = 0
        if not node.radio.full_duplex:
            turnaround = math.ceil(node.radio.turnaround_s * node.rate_hz)
        earliest = max(node.next_index + turnaround + MARGIN, node.free_from)
        start = max(burst.start, earliest)
        if burst.latest is not None and start > burst.latest:
            self.bursts_late += 1
            return None
        self.bursts += 1
        end = start + len(burst.samples)
        node.free_from = end + GAP
        if not node.radio.full_duplex:
            node.deaf.append((start - turnaround, end + turnaround))
        sent_at = node.time(start)
        for other_id, other in self._nodes.items():
            if other_id != node_id:
                self._carry(node_id, node, other_id, other, sent_at, burst.samples)
        return start

    def take(self, node_id: int, until: float) -> list[Piece]:
        """Take what the node's antenna receives up to the time `until`, in pieces."""
        node = self._nodes[node_id]
        end = node.index(until)
        pieces: list[Piece] = []
        while node.next_index < end:
            first = node.next_index
            is_deaf, upto = _next_stretch(node.deaf, first, end)
            heard = node.timeline.take(first, upto - first)
            pieces.append(Piece(upto - first, None if is_deaf else heard, is_deaf))
            node.next_index = upto
        node.deaf = [each for each in node.deaf if each[1] > node.next_index]
        return pieces

    def _carry(
        self, sender_id: int, sender: _Node, to_id: int, to: _Node, at: float, samples: Samples
    ) -> None:
        hop = self._world.hop(sender_id, to_id, at)
        if hop is None:
            return
        arrives = (at + hop.delay_s - to.joined_at) * to.rate_hz
        # Two clocks within one sample are in step, even if the quotient is rounded.
        whole, part = math.floor(arrives), arrives - math.floor(arrives)
        if abs(arrives - round(arrives)) < 1e-3:
            whole, part = round(arrives), 0.0
        power_db = 10 * math.log10(float(np.vdot(samples, samples).real) / len(samples) + 1e-30)
        params = PathParams(
            rate_hz=self._air.rate_hz,
            centre_hz=self._air.frequency_hz,
            profile=self._air.profile,
            delay_spread_s=self._air.delay_spread_s,
            loss_db=power_db - NOISE_DBFS - hop.snr_db,
            delay_s=part / self._air.rate_hz,
            clock_ppm=sender.radio.clock_ppm - to.radio.clock_ppm + hop.doppler_ppm,
        )
        pair = (sender_id, to_id)
        rng = self._rngs.get(pair)
        if rng is None:
            rng = self._rngs[pair] = np.random.default_rng([self._seed, *pair])
        to.timeline.add(whole, samples, Path(params, rng))


def _next_stretch(deaf: list[tuple[int, int]], first: int, end: int) -> tuple[bool, int]:
    """(whether the node is deaf at `first`, index at which that changes; at most `end`)."""
    now = [upto for begin, upto in deaf if begin <= first < upto]
    if now:
        return True, min(max(now), end)
    return False, min([begin for begin, _ in deaf if begin > first] + [end])
