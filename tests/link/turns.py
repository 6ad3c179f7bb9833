"""A team with the policy `grant` on an air of bursts, of which some are lost."""

from bisect import bisect_right
from itertools import islice
from random import Random
from typing import NamedTuple

from hypothesis import strategies as st

from sdrlinkd.link import PduLinkTraits, Qos, Sensed
from sdrlinkd.link.access import Waiting, Wish, make_access
from sdrlinkd.wire import Frame, Grant, Want
from tests.link.radios import params

PDU_S, LONGEST_S, STEP_S = 5e-4, 4e-3, 2e-4
ROOM = 60
BEACON_S = 1.0
LUCK = 0.03
TRAITS = PduLinkTraits(
    kind="ether", is_lockstep=True, senses=True, shares_air=True, turnaround_s=1e-4, lead_s=1e-4,
    react_s=STEP_S, detect_s=2.5e-5, gap_s=6e-6, pdu_burst_s=(PDU_S,), longest_burst_s=(LONGEST_S,),
)  # fmt: skip


class Burst(NamedTuple):
    """A burst in true time; `records` is how many it told."""

    begin: float
    end: float
    src: int
    records: int


class Robot:
    """A robot with airtime to send, whose clock is `ppm` too fast and starts when it joins."""

    def __init__(self, node, nodes, seed, joins_at, ppm, traits):
        self.id = node
        self.access = make_access(
            params("grant", nodes), node, traits, traits.longest_burst_s[0],
            Random(100 * seed + node),
        )  # fmt: skip
        self.joins_at, self.pace = joins_at, 1 + 1e-6 * ppm
        self.is_on = True
        self.urgent_at = []
        """When urgent messages of a PDU each come, in order."""
        self.bulk_s = 0.0
        self.beacon_at = 0.0
        self.free_at = 0.0
        self.heard_end = 0.0

    def clock(self, t):
        return (t - self.joins_at) * self.pace

    def waiting(self, t):
        if self.urgent_at and self.urgent_at[0] <= t:
            n = bisect_right(self.urgent_at, t)
            return Waiting(Qos.URGENT, 64, t - self.urgent_at[0], n * PDU_S, self.bulk_s)
        return Waiting(Qos.BULK, 0, t, self.bulk_s) if self.bulk_s > 0 else None


class Team:
    """Robots `nodes`; `links`: pairs that hear each other, None: all; `loss`: of each burst.

    The pairs in `weak` notice each other's signals, and read the share `luck` of their bursts.
    """

    def __init__(
        self, nodes, seed, links=None, loss=0.0, joins=None, traits=TRAITS, weak=(), luck=LUCK
    ):  # fmt: skip
        self.rng = Random(seed)
        self.robots = {
            node: Robot(
                node, nodes, seed, (joins or {}).get(node, 0.0), self.rng.uniform(-20, 20), traits
            )
            for node in nodes
        }
        self.links, self._loss, self._weak = links, loss, weak
        self._luck = luck
        self.traits = traits
        self.bursts = []
        self.waits_s = []
        """Waits of urgent messages, as (robot, when it came, wait in s)."""
        self.schedule = None
        """What identifies the schedule, once a plan was told."""
        self.t = 0.0

    def hears(self, one, other):
        return self.links is None or (one, other) in self.links or (other, one) in self.links

    def roots(self):
        return {each.id for each in self.robots.values() if each.is_on and each.access.plans}

    def tell_links(self):
        """Let all robots know all links, as LSAs do."""
        edges = {node: {} for node in self.robots}
        for one, other in self.links or ():
            edges[one][other] = edges[other][one] = 1.0
        for robot in self.robots.values():
            robot.access.know_links(edges)

    def run(self, until_s):
        while self.t < until_s:
            self.t += STEP_S
            for robot in self.robots.values():
                if robot.is_on and self.t >= robot.joins_at:
                    self._ask(robot)

    def _ask(self, robot):
        access, now = robot.access, robot.clock(self.t)
        earliest = max(now + self.traits.lead_s, robot.free_at)
        waiting = robot.waiting(self.t)
        is_due = earliest >= robot.beacon_at
        if waiting is None and not is_due and earliest < access.tells_at:
            return
        qos = Qos.DEFAULT if waiting is None else waiting.qos
        slot = access.slot(Wish(earliest, qos, PDU_S, Sensed(now, robot.heard_end), waiting))
        if slot is None:
            return
        assert slot.start >= earliest - 1e-9
        self._send(robot, slot, waiting, is_due)

    def _send(self, robot, slot, waiting, is_due):
        access = robot.access
        n_pdus = int((slot.end - slot.start) / PDU_S + 1e-6)
        left = None if waiting is None else waiting.without((n_pdus - 1) * PDU_S)
        has_plan = access.must_tell
        want = access.request(slot.start, left)
        is_urgent = waiting is not None and waiting.qos is Qos.URGENT
        # As the link does: a single PDU is for what is urgent, with the request in its spare room.
        if not has_plan and is_urgent and n_pdus == 1:
            n_told = 0
        else:
            n_told = int(has_plan or want is not None or (is_due and waiting is None))
        begin = robot.joins_at + slot.start / robot.pace
        n_data, most = 0, round(self.traits.longest_burst_s[0] / PDU_S)
        while n_told + n_data < min(n_pdus, most):
            if robot.urgent_at and robot.urgent_at[0] <= self.t:
                came = robot.urgent_at.pop(0)
                self.waits_s.append((robot.id, came, begin - came))
            elif robot.bulk_s > 0:
                robot.bulk_s -= PDU_S
            else:
                break
            n_data += 1
        length_s = max(1, n_told + n_data) * PDU_S
        records = access.told(slot.start, length_s, ROOM) if has_plan else []
        for record in records:
            if type(record).__name__ == "Frame":
                self.schedule = record.schedule
        if want is not None:
            records.append(want)
            access.requested(want, slot.start)
        if is_due:
            robot.beacon_at = slot.start + BEACON_S * self.rng.uniform(0.9, 1.1)
        access.sent(slot.start + length_s, None)
        robot.free_at = slot.start + length_s + self.traits.gap_s
        burst = Burst(begin, begin + length_s, robot.id, len(records))
        self.bursts.append(burst)
        for other in self.robots.values():
            pair = robot.id, other.id
            is_weak = pair in self._weak or pair[::-1] in self._weak
            is_heard = is_weak or self.hears(*pair)
            if other is robot or not is_heard or begin < other.joins_at:
                continue
            other.heard_end = max(other.heard_end, other.clock(burst.end))
            if self.rng.random() >= (1 - self._luck if is_weak else self._loss):
                self._hear(other, robot, records, other.clock(begin), is_weak=is_weak)

    def _hear(self, robot, src, records, at, *, is_weak):
        """What a robot takes from a burst; here it does so at once, which is soon enough."""
        access = robot.access
        access.heard(src.id, at, False, is_weak=is_weak)
        for node in self.robots:
            # As the reports in beacons do.
            if self.hears(src.id, node) and node != src.id and self.robots[node].is_on:
                access.told_of(node, at, src.id)
        for record in records:
            name = type(record).__name__
            if name == "Frame":
                access.take_frame(src.id, record, at)
            elif name == "Grant":
                access.take_grant(src.id, record, at, is_weak=is_weak)
            else:
                access.take_want(src.id, record, at)

    def clashes(self, since_s=0.0):
        """Pairs of bursts of which somebody hears both, less than a turnaround apart."""
        return [each for each in self.beside(since_s) if self.disturb(each[0].src, each[1].src)]

    def beside(self, since_s=0.0):
        """Pairs of bursts of two robots that are less than a turnaround apart."""
        bursts = sorted(each for each in self.bursts if each.begin > since_s)
        for i, one in enumerate(bursts):
            for other in islice(bursts, i + 1, None):
                if other.begin >= one.end + self.traits.turnaround_s - 1e-6:
                    break
                if one.src != other.src:
                    yield one, other

    def disturb(self, one, other):
        """Whether two robots hear each other, or somebody hears both."""
        return self.hears(one, other) or any(
            self.hears(one, node) and self.hears(other, node) for node in self.robots
        )


octet = st.integers(0, 255)
told_events = st.one_of(
    st.tuples(st.just("frame"), octet, octet, octet, st.booleans(), st.integers(0, 10**6)),
    st.tuples(
        st.just("grant"),
        octet,
        octet,
        octet,
        st.one_of(st.integers(0, 50_000), st.integers(0, 2**32 - 1)),
        st.lists(st.tuples(st.sampled_from([0, 1, 2, 3, 9, 255]), octet), max_size=20),
    ),
    st.tuples(st.just("want"), octet, st.integers(0, 3), octet, octet),
    st.tuples(st.just("of"), octet, octet),
    st.tuples(st.just("links"), octet, octet),
)
"""Whatever a robot may be told: (kind, robot, more)."""


def tell(access, event, schedule, now, since_s):
    """Let a policy take such an event at `now`; the last one was `since_s` before."""
    kind, *fields = event
    src = fields[0] % 4
    if kind == "frame":
        _, root, level, is_ours, phase_us = fields
        access.take_frame(src, Frame(root % 4, level, schedule if is_ours else 1, phase_us), now)
    elif kind == "grant":
        _, number, reach, begins_us, turns = fields
        at = now - since_s if number % 2 else now
        access.take_grant(src, Grant(number, reach, begins_us, tuple(turns)), at)
    elif kind == "want":
        access.take_want(src, Want(src, fields[1], 64, 1, *fields[2:]), now)
    elif kind == "of":
        access.heard(src, now, False)
        access.told_of(src, now, fields[1] % 4)
    else:
        access.know_links({src: {fields[1] % 4: 1.0}, fields[1] % 4: {src: 1.0}})
