"""Sends bursts at times that the device itself keeps."""

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
"""How long before its time the device gets a burst at most."""
GRACE_S = 0.1
"""How long after a burst's end its acknowledgement may come."""
SLACK = 16
"""Samples by which an acknowledgement may be early; the next burst ends later than that."""
TAIL = 8
"""Number of zeros after a burst; the next one begins later than that."""
IDLE_S = 0.5
"""Time without a burst after which the transmitter is switched off."""
BUSY_S, QUIET_S = 0.002, 0.1
"""How long to wait for commands while bursts are pending, and while none are."""

_NOTHING = np.zeros(0, np.complex64)


@dataclass
class _BurstOut:
    """A burst that the device has, or is being given."""

    command: TxCommand
    is_failed: bool = False
    is_begun: bool = False
    """Whether the device has a part of the burst."""
    is_whole: bool = False
    """Whether the device has all of the burst."""

    @property
    def end(self) -> int:
        """Index after its last sample."""
        return self.command.start + self.command.n


class TimestampedTransmitter:
    """Hands bursts to the device with their time and END_BURST, and reads their status."""

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
        """Wait briefly for commands, send the due ones, and read the status of earlier ones."""
        self._commands.wait(BUSY_S if self._out or self._commands.waiting else QUIET_S)
        while self._is_due():
            self._send(self._commands.waiting.popleft())
        self._look()
        if self._is_active and not self._out:
            self._rest()

    def _is_due(self) -> bool:
        """Whether the first command goes to the device now: early bursts would fill its queue."""
        waiting = self._commands.waiting
        # Before the first sample, an index has no device time.
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
        # END_BURST goes with the last write only: on an earlier one it would end the burst there.
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
        """The samples with zeros appended: some devices hold the last sample on the air."""
        return np.concatenate((samples, np.zeros(TAIL, np.complex64)))

    def _write(self, out: _BurstOut, samples: Values, flags: int, time_ns: int) -> bool:
        """Write samples; returns whether the device accepted all of them.

        Some devices accept late bursts, drop them and report them by status. A device that refuses
        them here would refuse them forever. Such a burst is given up at once, so that the daemon
        can reschedule it before the bursts behind it are late, too.
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
                # A burst that has begun to leave must not be sent again.
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
        """End a burst that was given up, so that the device does not wait for the rest of it.

        Some devices need a deactivated stream for that, others END_BURST.
        """
        self._stream.write(self._tx_stream.converted(_NOTHING), END_BURST, 0, WRITE_US)
        self._stream.deactivate()
        self._is_active = False

    def _look(self) -> None:
        """Read all status reports of the device."""
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
        """Settle the oldest burst; a time stamp may settle later ones and all before them."""
        self._acknowledges = True
        if time_ns is not None:
            end = self._clock.index_at(time_ns) + SLACK
            while len(self._out) > 1 and self._out[1].end <= end:
                self._settle("sent")
        if self._out:
            self._settle("sent")

    def _give_up(self) -> None:
        """Settle bursts with an overdue acknowledgement; without any, those that are over."""
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
            # A burst that does not begin has no end to acknowledge.
            self._out.remove(out)
        self._commands.done(out.command, outcome, out.command.start)

    def _rest(self) -> None:
        if time.monotonic_ns() - self._used_ns > IDLE_S * 1e9:
            self.stop()
