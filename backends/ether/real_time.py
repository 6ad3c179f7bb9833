"""A radio's side of an air in real time: it makes its samples from the bursts that arrive.

Nothing travels while the air is silent. A burst is on its way before it begins, and samples are
made a little after their time, so that a burst that was slow still comes in time. A burst that is
even slower begins late; then samples are made later for a while.
"""

import contextlib
import math
import select
import threading
import time
from collections import deque

import msgspec
import numpy as np
import zmq

from backends.air import AirCost
from backends.base import AbsentError, RefusalError, RxBlock, Samples
from backends.ether import protocol
from backends.ether.antenna import Antenna, Beside
from backends.ether.ear import Ear
from backends.ether.medium import path_of
from backends.ether.presence import ASK_S, Presence
from backends.ether.remote_clock import HubClock
from backends.ether.sockets import NOBLOCK, is_readable, received
from backends.outstanding import GAP

BEHIND_S = 0.0002
"""Samples are made this long after their time; longer once a burst was late."""
CALMS_S = 10.0
"""A longer delay decays by a factor of e in this time."""
LATEST_S = 0.05
"""A burst that is later than this is not heard."""
MAX_BEHIND_S = 0.5
"""A reader that is further behind misses samples."""
MAX_LATE_BLOCKS = 8
"""A late reader gets fewer, larger blocks."""
LONG_S = 0.01
"""Length of a block in s while nothing is on the air."""
HUB_WAS_GONE = "the hub was gone"


class RealTime:
    """Makes the blocks of one radio; for one thread.

    `hello` joins the hub again. `counters` are the radio's; `closing` ends every wait.
    """

    def __init__(
        self,
        socket: "zmq.Socket[bytes]",
        hello: protocol.Hello,
        welcome: protocol.Welcome,
        antenna: Antenna,
        clock: HubClock,
        counters: dict[str, int],
        closing: threading.Event,
    ) -> None:
        self._socket = socket
        self._hello = hello
        self._antenna = antenna
        self._clock = clock
        self._counters = counters
        self._closing = closing
        self._cost = AirCost(counters)
        self._presence = Presence(time.monotonic())
        self._has_greeted = False
        self._ready: deque[tuple[RxBlock, Beside]] = deque()
        self._placed: list[protocol.Placed] = []
        self._behind_s = BEHIND_S
        self._latest_ns = 0
        self.may_relax = False
        """Whether blocks may be longer while the air is quiet; may be set by any thread."""
        self.notice = ""
        """What the hub wants people to know."""
        self._begin(welcome)

    @property
    def is_away(self) -> bool:
        """Whether the hub is gone."""
        return self._presence.is_away

    def next(self) -> tuple[RxBlock, Beside] | None:
        """Wait for the next block, and what came with it. Raises BackendError; None at the end."""
        while not self._ready and not self._closing.is_set():
            self._read()
            if self._ready:
                break
            if self.is_away:
                self._wait(ASK_S)
                continue
            is_quiet = self.may_relax and self._ear.next_index >= self._quiet_from
            n, due = self._long if is_quiet else self._next_end(), self._due()
            if due > MAX_BEHIND_S * self._rate_hz:
                self._counters["overflows"] += 1
                self._counters["samples_lost"] += due
                self._miss(due, "the daemon was too slow")
            elif due >= n:
                late = (due - n) // self._short
                self._make(n + self._short * min(late, MAX_LATE_BLOCKS))
            else:
                self._wait((n - due) / self._rate_hz)
        return self._ready.popleft() if self._ready else None

    def _begin(self, welcome: protocol.Welcome) -> None:
        """Start the air's count at 0."""
        self._welcome = welcome
        self._rate_hz = self._hello.rate_hz * (1 + 1e-6 * welcome.radio.clock_ppm)
        self._short = max(1, round(welcome.block_s * self._rate_hz))
        self._long = max(self._short, round(LONG_S * self._rate_hz))
        self._turnaround = 0
        if not welcome.radio.full_duplex:
            self._turnaround = math.ceil(welcome.radio.turnaround_s * self._rate_hz)
        self._ear = Ear()
        self._quiet_from = 0
        self._ends: list[int] = []
        self._free: dict[int, int] = {}
        self._rngs: dict[int, np.random.Generator] = {}
        self._clock.observe(welcome.host_ns, time.monotonic_ns())

    def _hub_ns(self, index: int) -> int:
        """The hub's time of the sample before `index`, of the air's count."""
        return self._welcome.host_ns + round(1e9 * index / self._rate_hz)

    def _local_ns(self, index: int) -> int:
        """The same on our clock; it never goes back, whatever is learnt of the hub's clock."""
        self._latest_ns = max(self._latest_ns, self._clock.local_ns(self._hub_ns(index)))
        return self._latest_ns

    def _due(self) -> int:
        """Number of samples to make now."""
        now_ns = time.monotonic_ns() - self._clock.local_ns(self._welcome.host_ns)
        return int((1e-9 * now_ns - self._behind_s) * self._rate_hz) - self._ear.next_index

    def _next_end(self) -> int:
        """Length of a block: a usual one, or up to where a burst has arrived."""
        first = self._ear.next_index
        self._ends = [end for end in self._ends if end > first]
        return min([self._short, *(end - first for end in self._ends)])

    def _make(self, n: int) -> None:
        index = self._ear.next_index
        with self._cost:
            for piece in self._ear.take(index + n):
                index += piece.n
                self._add(self._antenna.receive(piece, self._local_ns(index)))
        calm = 1 - n / self._rate_hz / CALMS_S
        self._behind_s = BEHIND_S + (self._behind_s - BEHIND_S) * max(0.0, calm)

    def _miss(self, n: int, reason: str) -> None:
        index = self._ear.next_index + n
        self._ear.take(index)
        self._add(self._antenna.miss(n, reason, self._local_ns(index)))

    def _add(self, block: RxBlock, welcome: protocol.Welcome | None = None) -> None:
        self._ready.append((block, Beside(self._placed, 0, welcome)))
        self._placed = []

    def _wait(self, for_s: float) -> None:
        """Wait until the hub says something; ask from time to time whether it is there."""
        now_s = time.monotonic()
        self._counters["hub_outages"] += self._presence.has_gone(now_s)
        if self._presence.is_to_ask(now_s):
            self._has_greeted = False
            self._say(protocol.Question())
        # A message that has come already is not announced again.
        if not is_readable(self._socket):
            select.select([int(self._socket.fd)], [], [], min(for_s, ASK_S))

    def _say(self, message: protocol.Question | protocol.Hello) -> None:
        with contextlib.suppress(zmq.Again):
            self._socket.send(protocol.encode(message), NOBLOCK)

    def _read(self) -> None:
        """Handle all messages that have come."""
        while is_readable(self._socket):
            message, samples = received(self._socket)
            self._presence.heard(time.monotonic())
            if isinstance(message, protocol.Arriving):
                if samples is not None and len(samples):
                    self._arrives(message, samples)
            elif isinstance(message, protocol.News):
                self._hear_of(message)
            elif isinstance(message, protocol.Answer):
                self._hear_from(message)
            elif isinstance(message, protocol.Welcome):
                self._rejoin(message)
            elif isinstance(message, protocol.Refused):
                raise RefusalError(message.reason)

    def _arrives(self, message: protocol.Arriving, samples: Samples) -> None:
        """Let a burst of another radio arrive, at once if its time is over."""
        sender, index = message.sender, self._ear.next_index
        rng = self._rngs.get(sender)
        if rng is None:
            rng = self._rngs[sender] = np.random.default_rng([self._welcome.seed, sender])
        path = path_of(message.way, self._hello.rate_hz, self._hello.frequency_hz, rng)
        begin = max(message.at, index + path.early, self._free.get(sender, 0))
        late_s = (begin - message.at) / self._rate_hz
        if late_s > LATEST_S:
            self._counters["bursts_missed"] += 1
            return
        if late_s > 0:
            self._counters["bursts_slow"] += 1
            self._behind_s = min(self._behind_s + late_s, LATEST_S)
            # The sender's next burst must not overlap this one.
            self._free[sender] = begin + len(samples)
        self._quiet_from = max(self._quiet_from, begin + len(samples) + self._short)
        self._ends.append(begin + len(samples) + GAP)
        self._ear.add(begin, samples, path)

    def _hear_of(self, news: protocol.News) -> None:
        """Note where the radio's own bursts are; if half duplex, it hears nothing meanwhile."""
        self.notice = news.notice or self.notice
        self._placed += news.placed
        for _, start, n_samples in map(msgspec.structs.astuple, news.placed):
            if start is None:
                continue
            end = start + n_samples + self._turnaround
            self._quiet_from = max(self._quiet_from, end + self._short)
            if not self._welcome.radio.full_duplex:
                self._ear.be_deaf(start - self._turnaround, end)

    def _hear_from(self, answer: protocol.Answer) -> None:
        """Join a hub that does not know this radio; go on with one that does."""
        self._clock.observe(answer.host_ns, time.monotonic_ns())
        if self._hello.node not in answer.nodes:
            if not self._has_greeted:
                self._has_greeted = True
                self._say(self._hello)
        elif self.is_away:
            self._presence.came_back()
            if self._due() > MAX_BEHIND_S * self._rate_hz:
                self._miss(self._due(), HUB_WAS_GONE)

    def _rejoin(self, welcome: protocol.Welcome) -> None:
        """Join a hub that has no record of this radio: the air's count restarts."""
        if not welcome.paced:
            raise AbsentError("the hub keeps lock-step now")
        if not self.is_away:
            self._counters["hub_outages"] += 1
        self._presence.came_back()
        away_s = 1e-9 * (welcome.host_ns - self._hub_ns(self._ear.next_index))
        n = max(1, round(away_s * self._rate_hz))
        self._begin(welcome)
        self._add(self._antenna.rejoin(n, HUB_WAS_GONE, self._local_ns(0)), welcome)
