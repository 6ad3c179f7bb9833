"""The medium in bursts, not samples: decides who receives what, from tables of error rates."""

import math
from bisect import bisect_right, insort
from collections.abc import Sequence
from dataclasses import dataclass, field
from operator import attrgetter
from typing import NamedTuple

import numpy as np

import phy
from backends import (
    GAP,
    AirParams,
    Antenna,
    Capabilities,
    Hop,
    RadioParams,
    World,
    lockstep_capabilities,
)
from benchmarks.worlds.flight import (
    Flight,
    burst_shape,
    decibel,
    found_rate,
    head_snr_db,
    lost_rate,
    lost_rate_in,
)

NEVER = -1.0
TAIL = 2 * phy.SENSE_WINDOW
"""Samples by which energy may seem to last longer than the header says."""
PULSES_S = 0.1
"""Time for which a pulse is kept."""
KEPT_BEFORE_S = 2e-3
"""How long before a time a pulse may begin that matters after it."""
KEEP_S = 1.0
"""Maximum time for which a burst is kept after its end."""


class AirSense(NamedTuple):
    """State of a receiver at the time `until`; the channel has been idle since `idle_since`.

    While the channel is busy, `idle_since` is later than `until`. `burst_at`: arrival of the last
    burst's first sample; None if its header was not read, negative before the first burst.
    """

    until: float
    idle_since: float
    burst_at: float | None
    carrier_end: float = 0.0
    carrier_at: float | None = None
    pulses: tuple[float, ...] = ()
    """When pulses began that have ended, since the end of the last burst."""


class _Pulse(NamedTuple):
    """A pulse of energy, which arrives at each node that it is strong enough for."""

    sender: int
    start_s: float
    length_s: float
    arrives: dict[int, float]


_start = attrgetter("start_s")


@dataclass(slots=True)
class _Node:
    radio: RadioParams
    deaf: list[tuple[float, float]] = field(default_factory=list)
    free_from: float = NEVER
    energy_end: float = 0.0
    burst: tuple[float, float] = (NEVER, 0.0)
    """Start and end of the last burst whose header was read."""


class BurstChannel:
    """Nodes on one air, all on the same clock in s; power of `carrier_db` over noise is detected.

    A pair's SNR and delay are kept for `keep_s`, inf: forever; outages take effect at once. Each
    PDU is lost at each node with probability `lost`, whatever its SNR. Raises ValueError for a
    fading air, for which there are no tables. The error tables are for the usual grid, and other
    grids are close to it.
    """

    def __init__(
        self,
        air: AirParams,
        world: World,
        seed: int,
        carrier_db: float = 6.0,
        keep_s: float = 0.0,
        grid: phy.Numerology = phy.OFDM_64_16,
        lost: float = 0.0,
    ) -> None:
        if air.profile != "awgn":
            raise ValueError(f'air.profile: got "{air.profile}"; allowed in bursts: "awgn"')
        self._air = air
        self._grid = grid
        self._world = world
        self._keep_s = keep_s
        self._lost = lost
        self._loud_db = decibel(10 ** (carrier_db / 10) - 1)
        self._rng = np.random.default_rng(seed)
        self._nodes: dict[int, _Node] = {}
        self._hops: dict[int, tuple[float, dict[int, Hop]]] = {}
        self._live: list[Flight] = []
        self._pulses: list[_Pulse] = []
        """In order of their starts."""

    def join(self, node: int, radio: RadioParams) -> Capabilities:
        """Add a node; returns the capabilities of its radio."""
        self._nodes[node] = _Node(radio)
        self._hops.clear()
        return lockstep_capabilities(Antenna(radio, 0, self._air.rate_hz), self._air)

    def send(self, node: int, start_s: float, mcs: int, n_pdus: int, pdu_bytes: int) -> Flight:
        """Put a burst on the air, ahead of `start_s` by the turnaround or more.

        Raises ValueError if the node's last burst has not ended by then.
        """
        sender = self._nodes[node]
        if start_s < sender.free_from - 1e-9:
            raise ValueError(f"start: got {start_s:.6f} s; allowed: from {sender.free_from:.6f} on")
        shape = burst_shape(self._air.rate_hz, mcs, n_pdus, pdu_bytes, self._grid)
        hops = self._hops_of(node, start_s)
        arrives = {other: start_s + hop.delay_s for other, hop in hops.items()}
        draws = dict(zip(hops, self._rng.random((len(hops), 1 + n_pdus)).tolist(), strict=True))
        over_s = max(arrives.values(), default=start_s) + shape.airtime_s
        flight = Flight(node, start_s, over_s, shape, hops, arrives, draws)
        for other in list(self._live):
            if other.over_s + KEEP_S < start_s:
                self.settle(other)
            elif other.start_s < over_s and start_s < other.over_s:
                flight.near.append(other)
                other.near.append(flight)
        self._live.append(flight)
        sender.free_from = flight.end_s + GAP / self._air.rate_hz
        if not sender.radio.full_duplex:
            turn_s, oldest_s = sender.radio.turnaround_s, min(each.start_s for each in self._live)
            sender.deaf = [each for each in sender.deaf if each[1] > oldest_s]
            sender.deaf.append((start_s - turn_s, flight.end_s + turn_s))
        return flight

    def pulse(self, node: int, start_s: float, length_s: float) -> None:
        """Put a pulse on the air. It takes no part in the losses of bursts."""
        hops = self._hops_of(node, start_s)
        arrives = {
            other: start_s + hop.delay_s
            for other, hop in hops.items()
            if hop.snr_db > self._loud_db
        }
        del self._pulses[: bisect_right(self._pulses, start_s - PULSES_S, key=_start)]
        insort(self._pulses, _Pulse(node, start_s, length_s, arrives), key=_start)

    def readers(self, flight: Flight, number: int, nodes: Sequence[int]) -> list[tuple[int, float]]:
        """Those of `nodes` that decode a PDU, with the SNR in dB that their receivers report.

        Call this when the whole PDU has arrived at them, and before the flight is settled.
        """
        shape, (begin_s, end_s), read = flight.shape, flight.shape.pdus[number], []
        for node in nodes:
            at, snr_db = flight.arrives[node], flight.hops[node].snr_db
            if not self._finds(flight, node, at) or self._is_deaf(node, at, at + end_s):
                continue
            if flight.near:
                lost = lost_rate_in(flight, node, at + begin_s, at + end_s)
                snr_db = head_snr_db(flight, node, at)
            else:
                lost = lost_rate(shape.mcs, snr_db, shape.pdu_bytes)
            if flight.draws[node][1 + number] >= lost + self._lost * (1 - lost):
                read.append((node, snr_db))
        return read

    def settle(self, flight: Flight) -> None:
        """Finish a burst that has passed all nodes: keep only what each node knows of it."""
        for node, at in flight.arrives.items():
            one = self._nodes[node]
            if self._finds(flight, node, at) and at > one.burst[0]:
                one.burst = (at, at + flight.shape.airtime_s)
            else:
                one.energy_end = max(one.energy_end, self._energy_end(flight, node, at, math.inf))
        if flight in self._live:
            self._live.remove(flight)
        # Bursts that met it still refer to it; without its own list that chain does not grow.
        flight.near = []

    def sensed(self, node: int, t: float) -> AirSense:
        """What the node's receiver knows of the air at `t`, which must not be later than now."""
        energy_end, (begin, end) = self._nodes[node].energy_end, self._nodes[node].burst
        for flight in self._live:
            at = flight.arrives.get(node, t)
            if at < t:
                energy_end = max(energy_end, self._energy_end(flight, node, at, t))
                if begin < at <= t - flight.shape.head_s and self._finds(flight, node, at):
                    begin, end = at, at + flight.shape.airtime_s
        tail_s = TAIL / self._air.rate_hz
        burst_at: float | None = begin
        if energy_end > end + tail_s:
            is_over = energy_end + tail_s <= t
            end, burst_at = energy_end if is_over else t + 1 / self._air.rate_hz, None
        pulses = self._heard_pulses(node, end, t)
        if not pulses:
            return AirSense(t, end, burst_at, end, burst_at)
        return AirSense(t, pulses[-1][1], None, end, burst_at, tuple(at for at, _ in pulses))

    def _heard_pulses(self, node: int, since: float, t: float) -> list[tuple[float, float]]:
        """(begin, end) of the pulses that a node has heard completely between two times."""
        late = self._pulses[bisect_right(self._pulses, since - KEPT_BEFORE_S, key=_start) :]
        if not late:
            return []
        one, tail_s = self._nodes[node], TAIL / self._air.rate_hz
        own, turn_s = list[tuple[float, float]](), one.radio.turnaround_s
        if not one.radio.full_duplex:
            own = [
                (each.start_s - turn_s, each.start_s + each.length_s + turn_s)
                for each in late
                if each.sender == node
            ]
        deaf_until = one.deaf[-1][1] if one.deaf else NEVER
        found = []
        # This is the innermost loop of large teams.
        for each in late:
            begin = each.arrives.get(node)
            if begin is None or begin <= since:
                continue
            end = begin + each.length_s
            if end + tail_s > t:
                continue
            for first, last in own:
                if first < end and begin < last:
                    break
            else:
                if begin >= deaf_until or not self._is_deaf(node, begin, end):
                    found.append((begin, end))
        return sorted(found)

    def _hops_of(self, sender: int, t: float) -> dict[int, Hop]:
        if self._world.is_out(t):
            return {}
        until, hops = self._hops.get(sender, (-math.inf, {}))
        if t > until:
            there = {node: self._world.hop(sender, node, t) for node in self._nodes}
            hops = {node: hop for node, hop in there.items() if hop and node != sender}
            self._hops[sender] = (t + self._keep_s, hops)
        return hops

    def _finds(self, flight: Flight, node: int, at: float) -> bool:
        """Whether the node reads the header; call this only after the header's end."""
        found = flight.found.get(node)
        if found is None:
            found = flight.found[node] = (
                flight.draws[node][0] < found_rate(head_snr_db(flight, node, at))
                and not self._is_deaf(node, at, at + flight.shape.head_s)
                and not self._is_taken(flight, node, at)
            )
        return found

    def _is_taken(self, flight: Flight, node: int, at: float) -> bool:
        """Whether the receiver is busy with another burst, and has not been deaf since."""
        return any(
            ((begin := other.arrives.get(node, math.inf)), other.sender) < (at, flight.sender)
            and at < begin + other.shape.airtime_s
            and not self._is_deaf(node, begin, at)
            and self._finds(other, node, begin)
            for other in flight.near
        )

    def _is_deaf(self, node: int, begin: float, end: float) -> bool:
        deaf = self._nodes[node].deaf
        is_late = bool(deaf) and begin < deaf[-1][1]
        return is_late and any(first < end and begin < last for first, last in deaf)

    def _energy_end(self, flight: Flight, node: int, at: float, t: float) -> float:
        """Time until which the burst's power was detected, as of `t`."""
        if flight.hops[node].snr_db <= self._loud_db:
            return NEVER
        begin, end = at, min(t, at + flight.shape.airtime_s)
        for first, last in self._nodes[node].deaf:
            if first < end and begin < last:
                begin, end = (last, end) if last < end else (begin, first)
        return end if end - begin >= phy.SENSE_WINDOW / self._air.rate_hz else NEVER
