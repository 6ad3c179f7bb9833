"""Bursts at times that the device itself keeps."""

import time
from dataclasses import dataclass

import numpy as np

from backends.base import Samples
from backends.soapy.binding import (
    END_BURST,
    ERRORS,
    HAS_TIME,
    NOT_SUPPORTED,
    TIME_ERROR,
    TIMEOUT,
    UNDERFLOW,
    DriverError,
    Values,
)
from backends.soapy.protocol import TxCommand
from backends.soapy.radio_process.clock import SampleClock
from backends.soapy.radio_process.tx_commands import TxCommands
from backends.soapy.radio_process.tx_stream import TxStream

WRITE_US = 50_000
AHEAD_S = 0.25
"""A device gets bursts at most so long before their time."""
GRACE_S = 0.1
"""So long after its end a burst's acknowledgement may come."""
SLACK = 16
"""Samples by which a burst may be acknowledged too early; the next one ends later than that."""
TAIL = 8
"""Zeros behind a burst; the next one begins later than that."""
IDLE_S = 0.5
"""After so long without a burst the transmitter goes off."""
BUSY_S, QUIET_S = 0.002, 0.1
"""How long commands are waited for while bursts are out, and while none is."""

_NOTHING = np.zeros(0, np.complex64)


@dataclass
class _BurstOut:
    """A burst handed to the device, or on its way there."""

    command: TxCommand
    is_failed: bool = False
    is_begun: bool = False
    """The device has a part of it."""
    is_whole: bool = False
    """The device has all of it."""

    @property
    def end(self) -> int:
        """The index behind its last sample."""
        return self.command.start + self.command.n


class TimestampedTransmitter:
    """Hands bursts over with their time and END_BURST, and reads what became of them."""

    def __init__(self, commands: TxCommands, tx_stream: TxStream, clock: SampleClock) -> None:
        self._commands = commands
        self._tx_stream = tx_stream
        self._stream = tx_stream.stream
        self._clock = clock
        self._out: list[_BurstOut] = []
        self._acknowledges: bool | None = None
        self._tells = True
        self._is_active = False
        self._used_ns = 0

    def step(self) -> None:
        """Wait for commands a little, carry them out, look what became of others."""
        self._commands.wait(BUSY_S if self._out or self._commands.waiting else QUIET_S)
        while self._is_due():
            self._send(self._commands.waiting.popleft())
        self._look()
        if self._is_active and not self._out:
            self._rest()

    def _is_due(self) -> bool:
        """Whether the first command goes to the device now: what is far off fills its queue."""
        waiting = self._commands.waiting
        # Before the first sample, an index means nothing to the device.
        if not waiting or not self._clock.has_begun:
            return False
        ahead = self._clock.samples(round(1e9 * AHEAD_S))
        return waiting[0].start <= self._clock.now(time.monotonic_ns()) + ahead

    def stop(self) -> None:
        """Switch the transmitter off; stopping twice is fine."""
        if self._is_active:
            self._is_active = False
            self._stream.deactivate()

    def _send(self, command: TxCommand) -> None:
        if not self._is_active:
            self._tx_stream.activate()
            self._is_active = True
        out = _BurstOut(command)
        self._out.append(out)
        samples = self._tx_stream.converted(self._with_tail(self._commands.samples(command)))
        time_ns = self._clock.time_ns(command.start)
        # END_BURST only with what a device takes at once: of a part it would be the end.
        most = max(1, self._stream.mtu)
        last = (len(samples) - 1) // most * most
        flags = HAS_TIME
        for piece, more in ((samples[:last], 0), (samples[last:], END_BURST)):
            if len(piece) and not self._write(out, piece, flags | more, time_ns):
                break
            if len(piece):
                flags = 0
        out.is_whole = True

    @staticmethod
    def _with_tail(samples: Samples) -> Samples:
        """With zeros behind them: some devices keep the last sample on the air."""
        return np.concatenate((samples, np.zeros(TAIL, np.complex64)))

    def _write(self, out: _BurstOut, samples: Values, flags: int, time_ns: int) -> bool:
        """Whether the device took all of it.

        A device that tells of late bursts by status takes them, and drops them. One that refuses
        them here would refuse them for ever: the burst is given up at once, and the daemon plans
        another before those behind it are late, too.
        """
        until = out.end + self._clock.samples(round(1e9 * GRACE_S))
        while len(samples) and not self._commands.is_over:
            result = self._stream.write(samples, flags, time_ns, WRITE_US)
            self._commands.wait(0)
            self._look()
            if result.n > 0:
                samples = samples[result.n :]
                flags &= ~HAS_TIME
                out.is_begun = True
            elif result.n == UNDERFLOW:
                self._fail(out, "underflow")
            elif result.n == TIME_ERROR:
                # What has begun to leave must not go again.
                self._fail(out, "underflow" if out.is_begun else "late")
                if out.is_begun:
                    self._end_burst()
                return False
            elif result.n not in (0, TIMEOUT):
                raise DriverError(f"sending failed ({ERRORS.get(result.n, result.n)})")
            if self._clock.now(time.monotonic_ns()) > until:
                self._fail(out, "underflow")
                self._end_burst()
                return False
        return not len(samples)

    def _end_burst(self) -> None:
        """The device must not wait for the rest of a burst that was given up.

        To some, going off says so; to others, only END_BURST.
        """
        self._stream.write(self._tx_stream.converted(_NOTHING), END_BURST, 0, WRITE_US)
        self._stream.deactivate()
        self._is_active = False

    def _look(self) -> None:
        """Take all that the device has to tell of bursts handed to it."""
        while self._tells:
            told = self._stream.status(0)
            if told.n == NOT_SUPPORTED:
                self._tells = False
            elif told.n == UNDERFLOW:
                self._fail_oldest("underflow")
            elif told.n == TIME_ERROR:
                self._fail_oldest("late")
            elif told.n == 0 and told.flags & END_BURST:
                self._acknowledged(told.time_ns if told.flags & HAS_TIME else None)
            else:
                break
        self._give_up()

    def _acknowledged(self, time_ns: int | None) -> None:
        """The oldest burst has ended, or, by its time, a later one and all before it."""
        self._acknowledges = True
        if time_ns is not None:
            end = self._clock.index_at(time_ns) + SLACK
            while len(self._out) > 1 and self._out[1].end <= end:
                self._settle("sent")
        if self._out:
            self._settle("sent")

    def _give_up(self) -> None:
        """Settle bursts whose acknowledgement should be there; where there are none, those over."""
        now = self._clock.now(time.monotonic_ns())
        grace_s = 0.0 if self._acknowledges is None and not self._tells else GRACE_S
        grace = self._clock.samples(round(1e9 * grace_s))
        while self._out and self._out[0].is_whole and self._out[0].end + grace < now:
            self._settle("lost" if self._acknowledges else "sent")

    def _settle(self, outcome: str) -> None:
        out = self._out.pop(0)
        self._used_ns = time.monotonic_ns()
        if not out.is_failed:
            self._commands.done(out.command, outcome, out.command.start)

    def _fail_oldest(self, outcome: str) -> None:
        out = next((each for each in self._out if not each.is_failed), None)
        if out is not None:
            self._fail(out, outcome)

    def _fail(self, out: _BurstOut, outcome: str) -> None:
        if out.is_failed:
            return
        out.is_failed = True
        if outcome == "late" and out in self._out:
            # A burst that does not begin has no end to be acknowledged.
            self._out.remove(out)
        self._commands.done(out.command, outcome, out.command.start)

    def _rest(self) -> None:
        if time.monotonic_ns() - self._used_ns > IDLE_S * 1e9:
            self.stop()
