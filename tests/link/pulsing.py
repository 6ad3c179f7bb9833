"""An air of bursts and pulses, for the policy `auction`: each burst tells what comes next."""

from itertools import takewhile

from sdrlinkd.link import Sensed
from sdrlinkd.link.access import Waiting, make_auction, want_of
from sdrlinkd.wire import Want
from tests.link.air import Air
from tests.link.radios import DETECT_S, LOCKSTEP, params

PULSE_S = 192 / 5e6
ORDER_S = 0.05
"""Pulses are kept in the order of decisions, which is that of their beginnings to within this."""
FAST = LOCKSTEP._replace(pulse_s=PULSE_S)


class PulsingAir(Air):
    """Robots with the policy `auction` that all hear each other."""

    def __init__(self, n, seed, **more):
        self.pulses = []
        """Pulses as (true begin, robot)."""
        self.noise = []
        """When something else sent energy as short as a pulse, in true time."""
        self._wants = {}
        super().__init__(range(n), params("auction", range(n)), FAST, seed, **more)

    def make(self, node_id):
        """The auction itself, whoever hears whom."""
        return make_auction(self.params, node_id, self.traits)

    def waiting(self, node):
        if not node.waiting:
            return None
        head = node.waiting[0]
        return Waiting(head.qos, 0, 0.0, head.length_s)

    def _send(self, node, slot, earliest, head):
        if slot.is_pulse:
            assert slot.start >= earliest - 1e-9
            begin = node.true(slot.start)
            self.pulses.append((begin, node.id))
            node.free_at = slot.start + PULSE_S + self.traits.gap_s
            return
        super()._send(node, slot, earliest, head)
        waiting = self.waiting(node)
        node.access.told(waiting, slot.start)
        want = Want(node.id, 3, 0, 0, 0, 0) if waiting is None else want_of(node.id, waiting)
        self._wants[node.id, node.own[-1][0]] = want

    def _tell(self, node):
        while node.heard and node.heard[0].end <= node.until:
            burst = node.heard.pop(0)
            if self._reads(node, burst, burst.end):
                at = node.clock(burst.begin)
                node.access.heard(burst.src, at, False)
                node.access.take_want(burst.src, self._wants[burst.src, burst.begin], at)

    def sensed(self, node):
        carrier = super().sensed(node)
        after = node.true(carrier.idle_since)
        recent = takewhile(lambda pulse: pulse[0] > after - ORDER_S, reversed(self.pulses))
        heard = [*((begin, None) for begin in self.noise), *recent]
        known = sorted(
            node.clock(begin)
            for begin, src in heard
            if after < begin
            and src != node.id
            and begin + PULSE_S + DETECT_S <= node.until
            and not self._is_deaf(node, begin, begin + PULSE_S)
            and not self._pulsed(node, begin)
        )
        idle_since = max([carrier.idle_since, *(each + PULSE_S for each in known)])
        return Sensed(
            carrier.until, idle_since, None if known else carrier.burst_at,
            carrier.idle_since, carrier.burst_at, tuple(known),
        )  # fmt: skip

    def _pulsed(self, node, at):
        """Whether a robot sends a pulse itself, and so is deaf, at a true time."""
        deaf_s = PULSE_S + self.traits.turnaround_s
        return any(src == node.id and abs(at - begin) < deaf_s for begin, src in self.pulses[-40:])

    def disturbed(self):
        """Bursts during which another robot sent a pulse."""
        return [
            burst
            for burst in self.bursts
            for begin, src in self.pulses
            if src != burst.src and begin < burst.end and begin + PULSE_S > burst.begin
        ]
