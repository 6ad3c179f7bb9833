"""The air itself: when bursts leave, and how each node's antenna receives those of the others."""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from backends.base import Samples, TxBurst
from backends.ether.ear import Ear, Piece
from backends.ether.way import Way
from backends.ether.world import SPEED_OF_LIGHT, AirParams, RadioParams, World
from backends.outstanding import GAP
from phy import Path, PathParams

NOISE_DBFS = -80.0
"""Noise of every receiver. A burst's SNR is its power above this."""
MARGIN = 16
"""Samples by which a burst may arrive early at most: filter skirts, rounding between clocks."""


LEAD = MARGIN + 1
"""Number of samples before its start at which a burst must be handed over."""


class Arrival(NamedTuple):
    """A burst that arrives at `node`, at the sample `at` of its count."""

    node: int
    at: int
    way: Way


@dataclass
class _Node:
    radio: RadioParams
    rate_hz: float
    """The node's sample rate, as its own crystal makes it."""
    joined_at: float
    ear: Ear = field(default_factory=Ear)
    on_air: int = 0
    """Index of the first sample that may not have left yet."""
    free_from: int = 0

    def index(self, t: float) -> int:
        return math.floor((t - self.joined_at) * self.rate_hz)

    def time(self, index: int) -> float:
        return self.joined_at + index / self.rate_hz

    @property
    def turnaround(self) -> int:
        """Samples before and after its own bursts in which the node hears nothing."""
        return 0 if self.radio.full_duplex else math.ceil(self.radio.turnaround_s * self.rate_hz)


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
        return self._nodes[node_id].ear.next_index

    def pass_time(self, node_id: int, t: float) -> None:
        """Note that the node's samples before the time `t` have left: no burst can begin there."""
        node = self._nodes[node_id]
        node.on_air = max(node.on_air, node.index(t))

    def place(self, node_id: int, burst: TxBurst) -> tuple[int | None, list[Arrival]]:
        """Place a burst; returns (its start in the sender's count, arrivals); None: too late."""
        node = self._nodes[node_id]
        start = max(burst.start, node.on_air + node.turnaround + MARGIN, node.free_from)
        if burst.latest is not None and start > burst.latest:
            self.bursts_late += 1
            return None, []
        self.bursts += 1
        node.free_from = start + len(burst.samples) + GAP
        sent_at = node.time(start)
        found = (
            self._arrival(node_id, node, other_id, other, sent_at, burst.samples)
            for other_id, other in self._nodes.items()
            if other_id != node_id
        )
        return start, [each for each in found if each is not None]

    def send(self, node_id: int, burst: TxBurst) -> int | None:
        """Put a burst on the air; returns its start in the sender's count, None if too late."""
        start, arrivals = self.place(node_id, burst)
        node = self._nodes[node_id]
        if start is not None and not node.radio.full_duplex:
            turnaround = node.turnaround
            node.ear.be_deaf(start - turnaround, start + len(burst.samples) + turnaround)
        for node_to, at, way in arrivals:
            pair = (node_id, node_to)
            rng = self._rngs.get(pair)
            if rng is None:
                rng = self._rngs[pair] = np.random.default_rng([self._seed, *pair])
            path = path_of(way, self._air.rate_hz, self._air.frequency_hz, rng)
            self._nodes[node_to].ear.add(at, burst.samples, path)
        return start

    def take(self, node_id: int, until: float) -> list[Piece]:
        """Take what the node's antenna receives up to the time `until`, in pieces."""
        node = self._nodes[node_id]
        pieces = node.ear.take(node.index(until))
        node.on_air = node.ear.next_index
        return pieces

    def _arrival(
        self, sender_id: int, sender: _Node, to_id: int, to: _Node, at: float, samples: Samples
    ) -> Arrival | None:
        hop = self._world.hop(sender_id, to_id, at)
        if hop is None:
            return None
        arrives = (at + hop.delay_s - to.joined_at) * to.rate_hz
        # Two clocks within one sample are in step, even if the quotient is rounded.
        whole, part = math.floor(arrives), arrives - math.floor(arrives)
        if abs(arrives - round(arrives)) < 1e-3:
            whole, part = round(arrives), 0.0
        power_db = 10 * math.log10(float(np.vdot(samples, samples).real) / len(samples) + 1e-30)
        way = Way(
            profile=self._air.profile,
            delay_spread_s=self._air.delay_spread_s,
            loss_db=power_db - NOISE_DBFS - hop.snr_db,
            delay_s=part / self._air.rate_hz,
            clock_ppm=sender.radio.clock_ppm - to.radio.clock_ppm + hop.doppler_ppm,
            doppler_hz=hop.speed_m_s * self._air.frequency_hz / SPEED_OF_LIGHT,
        )
        return Arrival(to_id, whole, way)


def path_of(way: Way, rate_hz: float, centre_hz: float, rng: np.random.Generator) -> Path:
    """The path of one burst. Raises ValueError for an unknown profile."""
    return Path(PathParams(rate_hz=rate_hz, centre_hz=centre_hz, **way._asdict()), rng)
