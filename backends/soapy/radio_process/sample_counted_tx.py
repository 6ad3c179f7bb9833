"""Sends bursts on devices without time stamps, at positions found by counting samples."""

import time
from collections import deque
from dataclasses import dataclass

import numpy as np

from backends.soapy.binding import ERRORS, TIMEOUT, UNDERFLOW, DriverError, Values
from backends.soapy.protocol import TxCommand
from backends.soapy.radio_process.clock import SampleClock
from backends.soapy.radio_process.tx_commands import TxCommands
from backends.soapy.radio_process.tx_stream import TxStream
from backends.soapy.settings import HANDOVER_S, TRAILING

WRITE_US = 100_000
BUSY_S, QUIET_S = 0.002, 0.1
"""How long to wait for commands while some are pending, and while none are."""


@dataclass
class _BurstOut:
    """A burst handed to the device; its first sample leaves at `start`."""

    command: TxCommand
    start: int


class SampleCountedTransmitter:
    """Sends in TX windows: leading zeros, bursts at their positions, zeros up to whole transfers.

    Such devices send only whole transfers, whatever END_BURST says, and cut off what has not left
    when they are told to stop. Indices are only as accurate as the time at which the first sample
    leaves is known.
    """

    def __init__(
        self,
        commands: TxCommands,
        tx_stream: TxStream,
        clock: SampleClock,
        leading: int,
        longest_s: float,
        turnaround_s: float,
        in_flight: int,
    ) -> None:
        self._commands = commands
        self._tx_stream = tx_stream
        self._stream = tx_stream.stream
        self._clock = clock
        self._leading = leading
        self._longest = clock.samples(round(1e9 * longest_s))
        self._transfer = max(1, self._stream.mtu)
        self._zeros = np.zeros(self._transfer, np.complex64)
        self._in_flight = in_flight * self._transfer
        self._handover = self._in_flight + self._transfer + clock.samples(round(1e9 * HANDOVER_S))
        # Lead from the decision to send to the first sample of a burst.
        self._ahead = (
            clock.samples(round(1e9 * turnaround_s))
            + (1 + leading) * self._transfer
            + self._handover
        )
        self._origin = self._written = 0
        self._out: deque[_BurstOut] = deque()
        self.counters = {"tx_spells": 0}

    def step(self) -> None:
        """Wait briefly for commands; if one is due, send for a TX window."""
        self._commands.wait(BUSY_S if self._commands.waiting else QUIET_S)
        if self.is_due():
            self.send_window()

    def stop(self) -> None:
        """Do nothing: between TX windows the transmitter is off."""

    def is_due(self) -> bool:
        """Whether the TX window of the first command has to start now."""
        waiting = self._commands.waiting
        if not waiting or not self._clock.has_begun:
            return False
        return waiting[0].start <= self._clock.now(time.monotonic_ns()) + self._ahead

    def send_window(self) -> None:
        """Send all due bursts and those that arrive meanwhile; then switch the transmitter off."""
        self.counters["tx_spells"] += 1
        self._tx_stream.activate()
        # The driver's queue fills with zeros before our first sample.
        self._origin = self._clock.now(time.monotonic_ns()) + self._in_flight
        self._written = 0
        try:
            self._fill(self._leading * self._transfer)
            while self._next_command():
                self._send(self._commands.waiting.popleft())
            # Whole transfers and more: a device may take the first one up to a transfer later than
            # estimated, and may cut off the last one.
            self._fill(-self._written % self._transfer + TRAILING * self._transfer)
            self._drain()
        finally:
            self._stream.deactivate()

    def _next_command(self) -> bool:
        """Whether another burst joins this TX window; waits for one as long as time allows."""
        while not self._commands.is_over and self._written < self._longest:
            if self._commands.waiting:
                return self._commands.waiting[0].start <= self._end + self._ahead
            spare = self._end - self._handover - self._clock.now(time.monotonic_ns())
            if spare <= 0:
                return False
            self._commands.wait(max(1e-3, 1e-9 * self._clock.ns(spare)))
            self._settle()
        return False

    @property
    def _end(self) -> int:
        """Index at which the next sample written will leave."""
        return self._origin + self._written

    def _send(self, command: TxCommand) -> None:
        start = max(command.start, self._end)
        if command.latest is not None and start > command.latest:
            self._commands.done(command, "late", command.start)
            return
        self._fill(start - self._end)
        self._out.append(_BurstOut(command, start))
        self._write(self._tx_stream.converted(self._commands.samples(command)))

    def _fill(self, n: int) -> None:
        """Write `n` samples of silence."""
        while n > 0:
            some = self._zeros[: min(n, len(self._zeros))]
            self._write(self._tx_stream.converted(some))
            n -= len(some)

    def _write(self, samples: Values) -> None:
        """Write samples to the device. Raises DriverError when it accepts none for a long time."""
        since_ns = time.monotonic_ns()
        while len(samples):
            self._catch_up()
            result = self._stream.write(samples, 0, 0, WRITE_US)
            if result.n > 0:
                samples = samples[result.n :]
                self._written += result.n
                since_ns = time.monotonic_ns()
            elif result.n not in (0, TIMEOUT, UNDERFLOW):
                raise DriverError(f"sending failed ({ERRORS.get(result.n, result.n)})")
            elif time.monotonic_ns() - since_ns > 1e9:
                raise DriverError("it takes no samples for 1 s")

    def _drain(self) -> None:
        """Wait until all but the last zeros have left; the device does not report it."""
        while not self._commands.is_over:
            left = self._end - self._clock.now(time.monotonic_ns())
            if left <= 0:
                break
            self._commands.wait(max(1e-3, 1e-9 * self._clock.ns(left)))
            self._settle()
        self._settle()

    def _settle(self) -> None:
        now = self._clock.now(time.monotonic_ns())
        while self._out and self._out[0].start + self._out[0].command.n <= now:
            out = self._out.popleft()
            self._commands.done(out.command, "sent", out.start)

    def _catch_up(self) -> None:
        """Correct the count after an underrun, in which the device has sent something else.

        Drivers report underflows, too, but also those before the first transfer and after the last.
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
        """Report the bursts that the underrun interrupted; those that had ended were sent whole."""
        self._settle()
        now = self._clock.now(time.monotonic_ns())
        while self._out and self._out[0].start <= now:
            out = self._out.popleft()
            self._commands.done(out.command, "underflow", out.start)
