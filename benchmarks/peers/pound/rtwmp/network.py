"""Nodes on one half-duplex channel in simulated time."""

from collections.abc import Callable, Collection, Mapping
from heapq import heappop, heappush
from itertools import count
from math import inf
from random import Random
from typing import NamedTuple

from benchmarks.peers.pound.rtwmp.frames import Frame, Message, size
from benchmarks.peers.pound.rtwmp.node import Frames, Node
from benchmarks.peers.pound.rtwmp.params import Params

Deliver = Callable[[Message, float], None]
Watch = Callable[[Frame, float], None]


class OnAir(NamedTuple):
    """A frame that is being sent, with times in s."""

    frame: Frame
    begin: float
    end: float


class Network:
    """`n_nodes` nodes, of which the pairs in `links` hear each other.

    A frame is lost on a link with the probability in `loss`, or in `losses` for a pair in one
    direction (sender, receiver), or where two frames that a node hears overlap. A node does not
    begin while it hears a frame. The routes are known from the start, as in the paper.
    """

    def __init__(
        self, n_nodes: int, links: Collection[tuple[int, int]], params: Params, seed: int,
        loss: float = 0.0, losses: Mapping[tuple[int, int], float] | None = None,
        deliver: Deliver | None = None, watch: Watch | None = None,
    ) -> None:  # fmt: skip
        self.params, self.now = params, 0.0
        self.refused = 0
        """Messages that found a full queue."""
        self._n_nodes = n_nodes
        self._chance = Random(seed)
        both = {*links, *((b, a) for a, b in links)}
        self.loss = {pair: (losses or {}).get(pair, loss) for pair in both}
        """Probability of loss by (sender, receiver); it may change."""
        self._near = {node: [b for a, b in sorted(both) if a == node] for node in range(n_nodes)}
        self._deliver, self._watch = deliver, watch
        self._events: list[tuple[float, int, Callable[[], None]]] = []
        self._order = count()
        self._on_air: list[OnAir] = []
        self._off: set[int] = set()
        self._armed = [inf] * n_nodes
        self.nodes = [self._new_node(node) for node in range(n_nodes)]
        self.call(0.0, lambda: self.start(0))

    def call(self, at: float, what: Callable[[], None]) -> None:
        """Do something at a time in s."""
        heappush(self._events, (at, next(self._order), what))

    def start(self, node: int) -> None:
        """Let a node issue a token now."""
        self._do(node, self.nodes[node].start(self.now))

    def send(self, message: Message) -> None:
        """Put a message into its node's queue at its time."""
        self.call(message.at, lambda: self._push(message))

    def run(self, until: float) -> None:
        """Let the time pass."""
        while self._events and self._events[0][0] <= until:
            self.now, _, what = heappop(self._events)
            what()
        self.now = until

    def switch_off(self, node: int) -> None:
        """Take a radio from its node, which goes on without."""
        self._off.add(node)

    def switch_on(self, node: int) -> None:
        """Give the node its radio back."""
        self._off.discard(node)

    def kill(self, node: int) -> None:
        """Stop a node, with all that it knows."""
        self._off.add(node)
        self.nodes[node] = Node(node, self._n_nodes, self.params)
        self.nodes[node].due = self._armed[node] = inf

    def revive(self, node: int) -> None:
        """Start a node that was killed; it knows nothing."""
        self._off.discard(node)
        self.nodes[node].due = self.now + self.nodes[node].silence_s
        self._arm(node)

    def _new_node(self, number: int) -> Node:
        node = Node(number, self._n_nodes, self.params)
        ids = range(self._n_nodes)
        # Row i: how i hears the others.
        node.lqm.fill([[self._quality(b, a) for b in ids] for a in ids])
        return node

    def _quality(self, sender: int, receiver: int) -> float:
        """What stands for the signal's strength: the share of frames that come, in per cent."""
        loss = self.loss.get((sender, receiver))
        return 0.0 if loss is None else max(1.0, 100.0 * (1.0 - loss))

    def _push(self, message: Message) -> None:
        self.refused += not self.nodes[message.src].push(message)

    def _do(self, node: int, frames: Frames) -> None:
        """Send what a node has returned, and note when it is due."""
        for message in self.nodes[node].delivered:
            if self._deliver is not None:
                self._deliver(message, self.now)
        self.nodes[node].delivered.clear()
        for frame in frames:
            of = self.nodes[node]
            self.call(
                self.now + self.params.host_s + self.params.gap_s,
                lambda frame=frame, of=of: self._begin(of, frame),  # type: ignore[misc]
            )
        self._arm(node)

    def _arm(self, node: int) -> None:
        due = self.nodes[node].due
        if due < self._armed[node]:
            self._armed[node] = due
            self.call(max(due, self.now), lambda: self._expire(node))

    def _expire(self, node: int) -> None:
        if self._armed[node] > self.now:
            return
        self._armed[node] = inf
        self._do(node, self.nodes[node].expire(self.now))

    def _begin(self, node: Node, frame: Frame) -> None:
        if not node.wants(frame) or node is not self.nodes[node.number]:
            return
        heard = (*self._near[node.number], node.number)
        busy = [on_air.end for on_air in self._on_air if on_air.frame.sender in heard]
        if busy and max(busy) > self.now:
            again = max(busy) + self.params.gap_s
            self.call(again, lambda: self._begin(node, frame))
            return
        end = self.now + self.params.frame_s(size(frame.body, self._n_nodes))
        on_air = OnAir(frame, self.now, end)
        is_on = node.number not in self._off
        if is_on:
            self._on_air.append(on_air)
            if self._watch is not None:
                self._watch(frame, self.now)
        self.call(end, lambda: self._end(node, on_air, is_on))

    def _end(self, node: Node, on_air: OnAir, is_on: bool) -> None:
        frame = on_air.frame
        heard = [near for near in self._near[frame.sender] if self._is_heard(on_air, near)]
        node.sent(frame, self.now)
        self._arm(node.number)
        if is_on:
            for near in heard:
                quality = self._quality(frame.sender, near)
                self._do(near, self.nodes[near].hear(frame, quality, self.now))
        # What has ended still disturbs a frame that began before.
        others = [each for each in self._on_air if each.end >= self.now and each is not on_air]
        oldest = min((each.begin for each in others), default=inf)
        self._on_air = [each for each in self._on_air if each.end > oldest]

    def _is_heard(self, on_air: OnAir, at: int) -> bool:
        sender = on_air.frame.sender
        if at in self._off or sender in self._off:
            return False
        for other in self._on_air:
            if other is on_air or other.end <= on_air.begin or other.begin >= on_air.end:
                continue
            if other.frame.sender == at or (other.frame.sender, at) in self.loss:
                return False
        return self._chance.random() >= self.loss[sender, at]
