"""Simulates hours of many robots in seconds: real links on an air of bursts, in virtual time."""

import math
from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from heapq import heappop, heappush
from itertools import count

import phy
from backends import AirParams, RadioParams, World
from benchmarks.worlds.arrivals import Arrival
from benchmarks.worlds.burst_channel import BurstChannel
from benchmarks.worlds.chances import at_pace, next_chance
from benchmarks.worlds.flight import Flight
from benchmarks.worlds.station import Station
from sdrlinkd.config import ModemParams
from sdrlinkd.link import (
    AS_CONFIGURED,
    AccessParams,
    Burst,
    Delivered,
    Link,
    Opportunity,
    Outcome,
    Overrides,
    PduLinkTraits,
    RateParams,
)
from sdrlinkd.modem import Airtimes, pdu_link_traits

INFINITE = float("inf")
TICK_S = 0.05
"""Interval of a link's timers while something waits."""
IDLE_TICK_S = 1.0
"""Interval of the timers of idle links."""
KEPT_AGES = 1000
ROUNDING = 1e-3
"""Share of a block that counts as rounding: clocks are not exactly equal."""


@dataclass(slots=True)
class Pair:
    """Messages that one robot received of another's topic, with ages in s."""

    received: int = 0
    age_sum_s: float = 0.0
    """Sum over all messages."""
    ages_s: deque[float] = field(default_factory=lambda: deque(maxlen=KEPT_AGES))
    """The most recent ages."""


_Event = tuple[int, int, int, Callable[..., None], tuple[object, ...]]
# Actions after a block, in this order.
_HEAR, _SETTLE, _ARRIVE, _LOOK = range(4)


class Simulation:
    """One BurstChannel and a real link for each of `radios`; `arrivals` are in order of time.

    Decisions are made at the ends of blocks of `air.block_s`, as in a simulation of samples in
    lock-step. `watch` is called for every burst of PDUs, `listen` for what a node receives, with
    its time. `keep_s`, `lost`: see BurstChannel. Raises ConfigError if the radios cannot support
    the access policy. `fit` turns the air's traits into those of another radio, such as one that
    needs its bursts earlier.
    """

    def __init__(
        self,
        air: AirParams,
        world: World,
        radios: Mapping[int, RadioParams],
        links: Mapping[int, Link],
        modem: ModemParams,
        airtimes: Airtimes,
        access: AccessParams,
        arrivals: Mapping[int, Iterable[Arrival]],
        *,
        rate: RateParams | None = None,
        seed: int = 0,
        keep_s: float = 0.0,
        lost: float = 0.0,
        fit: Callable[[PduLinkTraits], PduLinkTraits] = lambda traits: traits,
        watch: Callable[[Flight, Burst], None] = lambda *_: None,
        listen: Callable[[int, Delivered, float], None] = lambda *_: None,
    ) -> None:
        self.now = 0.0
        self.pairs: defaultdict[tuple[int, int, int], Pair] = defaultdict(Pair)
        """Received messages by sender, receiver and topic id."""
        self._block_s = air.block_s
        self._airtimes = airtimes
        self._access = access
        self._watch = watch
        self._listen = listen
        grid = phy.GRIDS[modem.grid]
        self._medium = BurstChannel(air, world, seed, modem.carrier_db, keep_s, grid, lost)
        self._events: list[_Event] = []
        self._numbers = count()
        self.stations: dict[int, Station] = {}
        for node, radio in radios.items():
            link = links[node]
            can = self._medium.join(node, radio)
            traits = fit(pdu_link_traits("ether", can, modem, airtimes))
            settled, control, *_ = link.attach(traits, access, rate or RateParams())
            self._policy = settled.policy
            pace, coming = 1 + 1e-6 * radio.clock_ppm, iter(arrivals.get(node, ()))
            least_s = traits.turnaround_s + airtimes.airtime_s(max(control.usable), 1)
            station = self.stations[node] = Station(link, traits, settled, pace, coming, least_s)
            self._await_arrival(station)
            self._look(station, 0)
        self._at(self._block(TICK_S), _ARRIVE, self._tick)

    def run(self, until_s: float) -> None:
        """Advance time to `until_s`."""
        events, last = self._events, math.floor(until_s / self._block_s + ROUNDING)
        while events and events[0][0] <= last:
            block, _, _, what, arguments = heappop(events)
            self.now = block * self._block_s
            what(*arguments)
        self.now = until_s

    def call(self, at_s: float, what: Callable[[], None]) -> None:
        """Call `what` at `at_s`, before that block's decisions."""
        self._at(self._block(at_s), _ARRIVE, what)

    def submit(
        self, node: int, topic_id: int, payload: bytes, overrides: Overrides = AS_CONFIGURED
    ) -> None:
        """Submit a message that was just made."""
        station = self.stations[node]
        station.link.submit(topic_id, payload, self.now * station.pace, overrides)
        station.sent[topic_id] += 1
        self._look(station, self._block(self.now))

    def silence(self, node: int, until_s: float) -> None:
        """Let a radio send nothing until that time."""
        station = self.stations[node]
        station.free_at = max(station.free_at, until_s * station.pace)
        self._look(station, self._block(until_s))

    def _block(self, t: float) -> int:
        """Number of the block whose end is the first after `t`."""
        return math.ceil(t / self._block_s - ROUNDING)

    def _at(self, block: int, order: int, what: Callable[..., None], *arguments: object) -> None:
        heappush(self._events, (block, order, next(self._numbers), what, arguments))

    def _await_arrival(self, station: Station) -> None:
        arrival = next(station.arrivals, None)
        if arrival is not None:
            self._at(self._block(arrival.at), _ARRIVE, self._arrive, station, arrival)

    def _arrive(self, station: Station, arrival: Arrival) -> None:
        at, topic_id, payload, overrides = arrival
        station.link.submit(topic_id, payload, at * station.pace, overrides)
        station.sent[topic_id] += 1
        self._look(station, self._block(at))
        self._await_arrival(station)

    def _look(self, station: Station, block: int) -> None:
        """Query the link for a burst after this block, or earlier."""
        if block < station.look_at:
            station.look_at = block
            self._at(block, _LOOK, self._turn, station, block)

    def _turn(self, station: Station, block: int) -> None:
        """Do what the modem does after a block."""
        if station.look_at != block:
            return
        station.look_at = INFINITE
        link, traits, pace = station.link, station.traits, station.pace
        now, airtimes = self.now * pace, self._airtimes
        while True:
            looks_at = max(link.next_wakeup(now), station.free_at - traits.lead_s - traits.ahead_s)
            if looks_at > now:
                break
            sensed = at_pace(self._medium.sensed(link.own_id, self.now), pace)
            looks_at = next_chance(station, self._policy, self._access, sensed, now)
            if looks_at > now:
                break
            earliest = max(now + traits.lead_s, station.free_at)
            burst = link.next_burst(
                Opportunity(earliest, airtimes.airtime_s, airtimes.most_pdus, sensed)
            )
            if burst is None:
                looks_at = max(now, link.next_wakeup(now))
                if self._policy == "auction":
                    later = now + self._block_s * pace
                    chance = next_chance(station, self._policy, self._access, sensed, later)
                    looks_at = max(looks_at, chance)
                break
            self._send(station, burst)
        if looks_at < INFINITE:
            self._look(station, max(self._block(looks_at / pace), block + 1))

    def _send(self, station: Station, burst: Burst) -> None:
        link, pace, n_pdus = station.link, station.pace, len(burst.pdus)
        start_s, size = burst.start / pace, link.params.pdu_size
        if burst.is_pulse:
            self._medium.pulse(link.own_id, start_s, burst.airtime_s / pace)
            station.free_at = burst.start + burst.airtime_s + station.traits.gap_s
            left = self._block(start_s + burst.airtime_s)
            self._at(left, _HEAR, link.confirm, burst, Outcome.SENT, burst.start)
            return
        flight = self._medium.send(link.own_id, start_s, burst.mcs, n_pdus, size)
        station.free_at = (flight.end_s + station.traits.gap_s) * pace
        station.bursts += 1
        for number, (_, end_s) in enumerate(flight.shape.pdus):
            by_block = defaultdict(list)
            for node, at in flight.arrives.items():
                by_block[self._block(at + end_s)].append(node)
            for block, nodes in by_block.items():
                self._at(block, _HEAR, self._hear, flight, number, burst.pdus[number], nodes)
        left = self._block(flight.end_s)
        self._at(left, _HEAR, link.confirm, burst, Outcome.SENT, flight.end_s * pace)
        self._at(self._block(flight.over_s), _SETTLE, self._medium.settle, flight)
        self._watch(flight, burst)

    def _hear(self, flight: Flight, number: int, pdu: bytes, nodes: list[int]) -> None:
        for node, snr_db in self._medium.readers(flight, number, nodes):
            station = self.stations[node]
            link, pace = station.link, station.pace
            at = flight.arrives[node]
            ended_at = (at + flight.shape.pdus[number][1]) * pace
            for message in link.hear(pdu, at * pace, snr_db, self.now * pace, ended_at):
                age_s = link.delivered(message, self.now * pace)
                pair = self.pairs[message.src, node, message.topic_id]
                pair.received += 1
                if age_s is not None:
                    pair.age_sum_s += age_s
                    pair.ages_s.append(age_s)
                self._listen(node, message, self.now)
            if link.relays or station.settled.access.by_request is not None:
                self._look(station, self._block(self.now))

    def _tick(self) -> None:
        for station in self.stations.values():
            link = station.link
            # Who relays may await answers.
            waits = link.has_work or link.holds_parts or link.relays
            if waits or self.now - station.ticked_at >= IDLE_TICK_S:
                station.ticked_at = self.now
                link.handle_timers(self.now * station.pace)
        self._at(self._block(self.now + TICK_S), _ARRIVE, self._tick)
