"""In the radio process: bursts on devices that keep no time, placed by counting samples."""

import time
from collections import deque
from dataclasses import dataclass

import numpy as np

from backends.soapy.clock import SampleTime
from backends.soapy.orders import Orders
from backends.soapy.outgoing import Outgoing
from backends.soapy.protocol import Order
from backends.soapy.surface import (
    ERRORS,
    TIMEOUT,
    UNDERFLOW,
    DriverError,
    Values,
)
from backends.soapy.traits import HANDOVER_S, TRAILING

WRITE_US = 100_000
BUSY_S, QUIET_S = 0.002, 0.1
"""How long orders are waited for while one is not due yet, and while none is there."""


@dataclass
class _Out:
    """A burst whose first sample is `start`."""

    order: Order
    start: int


class CountedSender:
    """Sends in spells: zeros, bursts where they belong, zeros up to whole transfers, off again.

    Such devices send only whole transfers, whatever END_BURST says, and cut off what has not left
    when they are told to stop. Indices are as good as the moment at which the first sample leaves
    is known.
    """

    def __init__(
        self,
        orders: Orders,
        outgoing: Outgoing,
        clock: SampleTime,
        leading: int,
        longest_s: float,
        turnaround_s: float,
        in_flight: int,
    ) -> None:
        self._orders = orders
        self._outgoing = outgoing
        self._stream = outgoing.stream
        self._clock = clock
        self._leading = leading
        self._longest = clock.samples(round(1e9 * longest_s))
        self._transfer = max(1, self._stream.mtu)
        self._zeros = np.zeros(self._transfer, np.complex64)
        self._in_flight = in_flight * self._transfer
        self._handover = self._in_flight + self._transfer + clock.samples(round(1e9 * HANDOVER_S))
        # From the decision to send to the first sample of a burst.
        self._ahead = (
            clock.samples(round(1e9 * turnaround_s))
            + (1 + leading) * self._transfer
            + self._handover
        )
        self._origin = self._written = 0
        self._out: deque[_Out] = deque()
        self.counters = {"tx_spells": 0}

    def step(self) -> None:
        """Wait for orders a little; if there are any, send for a spell."""
        self._orders.wait(BUSY_S if self._orders.waiting else QUIET_S)
        if self.is_due():
            self.send_spell()

    def stop(self) -> None:
        """Nothing is on between spells."""

    def is_due(self) -> bool:
        """Whether the first order has to go on its way now."""
        waiting = self._orders.waiting
        if not waiting or not self._clock.has_begun:
            return False
        return waiting[0].start <= self._clock.now(time.monotonic_ns()) + self._ahead

    def send_spell(self) -> None:
        """All that is to be sent, and what comes meanwhile; the transmitter is off afterwards."""
        self.counters["tx_spells"] += 1
        self._outgoing.activate()
        # Zeros are in flight before what is written first.
        self._origin = self._clock.now(time.monotonic_ns()) + self._in_flight
        self._written = 0
        try:
            self._fill(self._leading * self._transfer)
            while self._next_order():
                self._send(self._orders.waiting.popleft())
            # Whole transfers, and more: a device takes the first one up to a transfer later than
            # we think, and the last one may be cut off.
            self._fill(-self._written % self._transfer + TRAILING * self._transfer)
            self._drain()
        finally:
            self._stream.deactivate()

    def _next_order(self) -> bool:
        """Whether another burst goes in this spell; waits as long as there is time to."""
        while not self._orders.is_over and self._written < self._longest:
            if self._orders.waiting:
                return self._orders.waiting[0].start <= self._end + self._ahead
            spare = self._end - self._handover - self._clock.now(time.monotonic_ns())
            if spare <= 0:
                return False
            self._orders.wait(max(1e-3, 1e-9 * self._clock.ns(spare)))
            self._settle()
        return False

    @property
    def _end(self) -> int:
        """Where what is written next will leave."""
        return self._origin + self._written

    def _send(self, order: Order) -> None:
        start = max(order.start, self._end)
        if order.latest is not None and start > order.latest:
            self._orders.done(order, "late", order.start)
            return
        self._fill(start - self._end)
        self._out.append(_Out(order, start))
        self._write(self._outgoing.converted(self._orders.samples(order)))

    def _fill(self, n: int) -> None:
        """Silence."""
        while n > 0:
            some = self._zeros[: min(n, len(self._zeros))]
            self._write(self._outgoing.converted(some))
            n -= len(some)

    def _write(self, samples: Values) -> None:
        """Raises DriverError when the device takes nothing for a long time."""
        since_ns = time.monotonic_ns()
        while len(samples):
            self._catch_up()
            moved = self._stream.write(samples, 0, 0, WRITE_US)
            if moved.n > 0:
                samples = samples[moved.n :]
                self._written += moved.n
                since_ns = time.monotonic_ns()
            elif moved.n not in (0, TIMEOUT, UNDERFLOW):
                raise DriverError(f"sending failed ({ERRORS.get(moved.n, moved.n)})")
            elif time.monotonic_ns() - since_ns > 1e9:
                raise DriverError("it takes no samples for 1 s")

    def _drain(self) -> None:
        """Until all but the last zeros have left; there is nothing that would tell."""
        while not self._orders.is_over:
            left = self._end - self._clock.now(time.monotonic_ns())
            if left <= 0:
                break
            self._orders.wait(max(1e-3, 1e-9 * self._clock.ns(left)))
            self._settle()
        self._settle()

    def _settle(self) -> None:
        now = self._clock.now(time.monotonic_ns())
        while self._out and self._out[0].start + self._out[0].order.n <= now:
            out = self._out.popleft()
            self._orders.done(out.order, "sent", out.start)

    def _catch_up(self) -> None:
        """A device that was given too little has sent something of its own in the meantime.

        Drivers tell of underflows, too, but of those before the first transfer and after the last
        as well.
        """
        now = self._clock.now(time.monotonic_ns())
        if self._written < self._transfer:
            self._origin = now + self._in_flight - self._written
            return
        late = now + self._in_flight - self._end
        if late > 0:
            self._underflow()
            self._origin += -(-late // self._transfer) * self._transfer

    def _underflow(self) -> None:
        """What is on its way was torn apart; what was over by then was not."""
        self._settle()
        now = self._clock.now(time.monotonic_ns())
        while self._out and self._out[0].start <= now:
            out = self._out.popleft()
            self._orders.done(out.order, "underflow", out.start)
