"""An air of bursts instead of samples: nodes with access policies, which decide periodically."""

from bisect import bisect_left, insort
from heapq import heappop, heappush
from math import floor
from operator import attrgetter
from random import Random
from typing import NamedTuple

from sdrlinkd.link import Qos, Sensed
from sdrlinkd.link.access import Wish, make_access
from tests.link.radios import AHEAD_S, DETECT_S, LOOK_S

INFINITE = float("inf")
HEADER_S = 0.0003
"""Time from the start of a burst until its header is read."""
LEAST_S = 0.0005
"""The shortest burst."""
BEACON_S = 1.0
_LOOKED_AT = 12
"""Number of most recent bursts to examine when the channel may be busy, whatever overlaps."""
_begin = attrgetter("begin")
_end = attrgetter("end")


class Message(NamedTuple):
    """A waiting message, which is sent in one burst."""

    qos: Qos
    at: float
    length_s: float


class Burst(NamedTuple):
    """A burst; times are true, `until` is the end of what the sender had heard when it decided."""

    begin: float
    end: float
    src: int
    qos: Qos
    arrived_at: float
    until: float
    missed_by: frozenset
    frame: object


class Node:
    """One robot. Its clock starts when it joins, and is `ppm` too fast."""

    def __init__(self, node_id, access, joined_at, ppm):
        self.id = node_id
        self.access = access
        self.joined_at = joined_at
        self.pace = 1 + 1e-6 * ppm
        self.waiting = []
        self.until = joined_at
        self.free_at = 0.0
        self.beacon_at = 0.0
        self.own = []
        self.heard = []
        self.phase = 0.0
        self.is_on = True
        self.looks_at = INFINITE

    def clock(self, t):
        return (t - self.joined_at) * self.pace

    def true(self, at):
        return self.joined_at + at / self.pace


class Air:
    """Nodes `ids`, each with its own access policy, and bursts of at most `longest_s`.

    `hears`: pairs (to, from), None: all; `ppm` and `joins` by node; `beacons`: each announces its
    frame once per second; `miss`: probability that a node cannot read a burst that it hears.
    """

    def __init__(
        self, ids, params, traits, seed, longest_s=0.004, *,
        hears=None, ppm=None, joins=None, beacons=False, miss=0.0,
    ):  # fmt: skip
        self.seed = seed
        self.rng = Random(seed)
        self.traits = traits
        self.longest_s = longest_s
        self.params = params
        self.bursts = []
        self._hears = hears
        self._miss = miss
        self._beacons = beacons
        self._events = []
        self._count = 0
        self.nodes = {}
        for node_id in ids:
            self.join(node_id, (joins or {}).get(node_id, 0.0), (ppm or {}).get(node_id, 0.0))

    def make(self, node_id):
        """The access policy of a robot."""
        return make_access(self.params, node_id, self.traits, self.longest_s, Random(node_id))

    def join(self, node_id, at=0.0, ppm=0.0):
        """Switch a robot on."""
        node = self.nodes[node_id] = Node(node_id, self.make(node_id), at, ppm)
        node.phase = at + (0.0 if self.traits.is_lockstep else self.rng.uniform(0, LOOK_S))
        self._look_next(node, node.phase)
        return node

    def leave(self, node_id):
        """Switch a robot off."""
        self.nodes.pop(node_id).is_on = False

    def offer(self, node_id, at, qos=Qos.DEFAULT, length_s=None):
        """Add a message that waits from `at` on."""
        message = Message(qos, at, self.longest_s if length_s is None else length_s)
        self.schedule(at, self._arrive, self.nodes[node_id], message)

    def offer_randomly(self, until_s, per_s, classes=tuple(Qos), fixed=False, begin_s=0.0):
        """Add Poisson arrivals at each node, `per_s` of each class."""
        for node_id in self.nodes:
            for qos in classes:
                at = begin_s
                while (at := at + self.rng.expovariate(per_s)) < until_s:
                    length_s = self.rng.uniform(LEAST_S, self.longest_s)
                    self.offer(node_id, at, qos, self.longest_s if fixed else length_s)

    def saturate(self, n, at=0.0, qos=Qos.DEFAULT):
        """Add `n` messages that wait at each node from `at` on."""
        for node_id in self.nodes:
            for _ in range(n):
                self.offer(node_id, at, qos)

    def run(self, until_s):
        """Advance time; returns the bursts so far, by start time."""
        while self._events and self._events[0][0] <= until_s:
            t, _, what, arguments = heappop(self._events)
            what(t, *arguments)
        return self.bursts

    def hears(self, to, src):
        return to != src and (self._hears is None or (to, src) in self._hears)

    def clashes(self, apart_s=0.0):
        """Pairs of bursts less than `apart_s` apart that one node hears both, or should."""
        found = []
        longest_s = max((each.end - each.begin for each in self.bursts), default=0.0)
        for i, one in enumerate(self.bursts):
            for other in self.bursts[i + 1 :]:
                if other.begin > one.begin + longest_s + apart_s:
                    break
                if other.begin - one.end < apart_s - 1e-9 and self._meet(one.src, other.src):
                    found.append((one, other))
        return found

    def assert_nobody_clashes(self, since=0.0):
        """Assert no clashes, and that no burst starts while earlier senders are still deaf."""
        clashes = self.clashes(self.traits.turnaround_s)
        assert not [each for each in clashes if each[0].begin > since], f"seed {self.seed}"

    def _meet(self, one, other):
        if one == other or self._hears is None:
            return one != other
        listeners = {to for to, _ in self._hears}
        return self.hears(one, other) or any(
            self.hears(to, one) and self.hears(to, other) for to in listeners
        )

    def schedule(self, at, what, *arguments):
        self._count += 1
        heappush(self._events, (at, self._count, what, arguments))

    def _look_next(self, node, at):
        """Decide next at the end of a block; an idle node decides to announce its frame."""
        if not node.waiting:
            if not self._beacons:
                return
            due = node.true(node.beacon_at) - self.traits.lead_s - AHEAD_S
            at += LOOK_S * max(0, floor((due - at) / LOOK_S))
        node.looks_at = at
        self.schedule(at + self._delay_s(), self._look, node, at)

    def _delay_s(self):
        return 0.0 if self.traits.is_lockstep else self.rng.uniform(0, 0.002)

    def _look(self, t, node, block_end):
        if node.is_on and block_end == node.looks_at:
            node.until = block_end
            node.looks_at = INFINITE
            self.decide(t, node)
            self._look_next(node, block_end + LOOK_S)

    def _arrive(self, t, node, message):
        if node.is_on:
            insort(node.waiting, message)
            if node.looks_at > t + 2 * LOOK_S:
                blocks = floor((t - self._delay_s() - node.phase) / LOOK_S)
                node.until = max(node.until, node.phase + blocks * LOOK_S)
                self._look_next(node, node.phase + (blocks + 1) * LOOK_S)
            self.decide(t, node)

    def decide(self, t, node):
        """Decide as the modem does: whenever something waits, for a time in the near future."""
        lead_s = self.traits.lead_s
        while True:
            soonest = node.clock(t) + lead_s
            earliest = max(soonest, node.free_at)
            is_due = self._beacons and earliest >= node.beacon_at
            if not (node.waiting or is_due) or earliest > soonest + AHEAD_S:
                return
            self._tell(node)
            head = node.waiting[0] if node.waiting else Message(Qos.DEFAULT, t, LEAST_S)
            slot = node.access.slot(Wish(earliest, head.qos, LEAST_S, self.sensed(node)))
            if slot is None:
                return
            self._send(node, slot, earliest, head)

    def _send(self, node, slot, earliest, head):
        assert slot.start >= earliest - 1e-9, "before it can"
        length_s = min(head.length_s, slot.end - slot.start)
        assert length_s >= LEAST_S - 1e-9, "no room for what was asked for"
        frame = None
        if self._beacons and slot.start >= node.beacon_at:
            frame = node.access.frame(slot.start)
            node.beacon_at = slot.start + BEACON_S * self.rng.uniform(0.9, 1.1)
        if node.waiting:
            node.waiting.pop(0)
        end = slot.start + length_s
        node.access.sent(end, None)
        node.free_at = end + self.traits.gap_s
        begin, true_end = node.true(slot.start), node.true(end)
        missed_by = frozenset(to for to in self.nodes if self.rng.random() < self._miss)
        burst = Burst(begin, true_end, node.id, head.qos, head.at, node.until, missed_by, frame)
        insort(self.bursts, burst, key=_begin)
        node.own.append((begin, true_end))
        for other in self.nodes.values():
            if self.hears(other.id, node.id):
                insort(other.heard, burst, key=_end)

    def _is_deaf(self, node, begin, end):
        turnaround_s = self.traits.turnaround_s
        return any(
            begin < last + turnaround_s and end > first - turnaround_s
            for first, last in node.own[-4:]
        )

    def _reads(self, node, burst, end):
        """Whether `burst` up to `end` was alone on the air at the node, and can be read."""
        if (
            node.id in burst.missed_by
            or burst.begin < node.joined_at
            or self._is_deaf(node, burst.begin, end)
        ):
            return False
        last = bisect_left(self.bursts, end, key=_begin)
        return not any(
            other.end > burst.begin and other is not burst and self.hears(node.id, other.src)
            for other in self.bursts[max(0, last - _LOOKED_AT) : last]
        )

    def sensed(self, node):
        """What the node's receiver knows of the air."""
        until, turnaround_s = node.until, self.traits.turnaround_s
        begin = end = energy_end = awake_since = node.joined_at
        for first, last in node.own[-4:]:
            if first < until:
                awake_since = max(awake_since, last + turnaround_s)
        read = False
        for i in range(bisect_left(self.bursts, until, key=_begin) - 1, -1, -1):
            burst = self.bursts[i]
            if burst.begin + self.longest_s < max(end, energy_end):
                # Neither this burst nor an earlier one was the last.
                break
            if not self.hears(node.id, burst.src):
                continue
            header_end = burst.begin + HEADER_S
            if not read and until >= header_end and self._reads(node, burst, header_end):
                read, begin, end = True, burst.begin, burst.end
            heard_to = min(until, burst.end)
            if heard_to - max(burst.begin, awake_since) >= DETECT_S:
                energy_end = max(energy_end, heard_to)
        at = node.clock
        if energy_end > end + DETECT_S:
            is_over = energy_end + DETECT_S <= until
            return Sensed(at(until), at(energy_end) if is_over else at(until) + 1e-6, None)
        return Sensed(at(until), at(end), at(begin))

    def _tell(self, node):
        """Report all bursts that have been heard completely by now."""
        while node.heard and node.heard[0].end <= node.until:
            burst = node.heard.pop(0)
            if self._reads(node, burst, burst.end):
                at = node.clock(burst.begin)
                node.access.heard(burst.src, at, False)
                if burst.frame is not None:
                    node.access.take_frame(burst.src, burst.frame, at)
