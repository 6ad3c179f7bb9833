"""Receives samples from the device into shared memory, and gives each an index."""

import socket
import time

import numpy as np

from backends.base import Samples
from backends.soapy.binding import (
    CORRUPTION,
    ERRORS,
    HAS_TIME,
    OVERFLOW,
    TIME_ERROR,
    TIMEOUT,
    DriverError,
    Stream,
    StreamResult,
    Values,
)
from backends.soapy.protocol import GapReason, RxChunk, SampleRing, pack_rx_chunk
from backends.soapy.radio_process.clock import SampleClock
from backends.soapy.radio_process.rate_watch import RateWatch

STALLED_S = 1.0
"""An active stream without samples for this long is restarted, and the next time given up."""
TOLERANCE = 2
"""Allowed rounding error of a device's time stamps, in samples."""
MOST_US = 100_000


class RxStream:
    """The receive stream of one device, from index 0 on. Owned by one thread."""

    def __init__(
        self,
        stream: Stream,
        form: str,
        ring: SampleRing,
        rx_socket: socket.socket,
        clock: SampleClock,
        piece: int,
        has_time: bool,
        rate_hz: float,
    ) -> None:
        self._stream = stream
        self._ring = ring
        self._rx_socket = rx_socket
        self.clock = clock
        self._piece = piece
        self._has_time = has_time
        self._reader = _SampleReader(form, piece)
        self._next = 0
        self._begun = self._at = self._until = 0
        self._unsure = 0
        self._missed: GapReason | None = None
        self._heard_ns = time.monotonic_ns()
        self._was_restarted = False
        self.rate = RateWatch(clock, rate_hz, piece)
        self.counters = {"overflows": 0, "samples_lost": 0, "stalls": 0, "clock_jumps": 0}

    def start(self) -> None:
        """Make the device receive. Raises DriverError."""
        _check(self._stream.activate())
        self._heard_ns = time.monotonic_ns()

    def pause(self) -> None:
        """Stop receiving, for devices that cannot send at the same time."""
        self._tell(time.monotonic_ns())
        _check(self._stream.deactivate())

    def resume(self, reason: GapReason = GapReason.SENDING) -> None:
        """Receive again; the gap is measured by the next time stamp or this host's clock."""
        self.start()
        self._missed = reason

    def step(self, timeout_us: int = MOST_US) -> None:
        """Call the driver once and process the result. Raises DriverError if the stream failed."""
        room = self._room()
        result = self._reader.read(self._stream, room, timeout_us)
        host_ns = time.monotonic_ns()
        if result.n > 0:
            self._received(result, room is not None, host_ns)
        elif result.n in (TIMEOUT, 0):
            self._waited(host_ns)
        elif result.n == OVERFLOW and not self._has_time:
            self._drain()
        elif result.n in (OVERFLOW, TIME_ERROR, CORRUPTION):
            # The next time stamp shows how many samples are missing.
            self.counters["overflows"] += 1
        else:
            _check(result.n)

    def _room(self) -> Samples | None:
        """Memory for the next samples; None: the daemon has not made room."""
        if self._at == self._until:
            begin = self._ring.whole(self._at, self._piece)
            if begin + self._piece - self._ring.tail > self._ring.capacity:
                return None
            self._begun = self._at = begin
            self._until = begin + self._piece
        return self._ring.view(self._at, self._until - self._at)

    def _received(self, result: StreamResult, is_kept: bool, host_ns: int) -> None:
        self._heard_ns, self._was_restarted = host_ns, False
        if result.flags & HAS_TIME and self._has_time:
            self._place(result.time_ns, host_ns)
        elif self._missed is not None:
            # These samples have just arrived, so the missing ones lie before them.
            n = max(0, self.clock.now(host_ns) - self._next - result.n)
            if self._missed is GapReason.OVERFLOW:
                self._lost(n)
            self._gap(n, self._missed, host_ns)
        self._missed = None
        self._next += result.n
        self.clock.saw(self._next, host_ns)
        self.rate.saw(self._next, host_ns)
        if not is_kept:
            self._lost(result.n)
            return
        self._at += result.n
        if self._at == self._until:
            self._tell(host_ns)

    def _place(self, time_ns: int, host_ns: int) -> None:
        """Compare the next sample's index by its time stamp with the expected index."""
        if not self.clock.knows_time:
            self.clock.begin(time_ns, self._next)
            return
        ahead = self.clock.index_at(time_ns) - self._next
        if ahead < -TOLERANCE:
            # The device's clock was set back; our indices never go back.
            self.counters["clock_jumps"] += 1
            self._tell(host_ns)
            self._gap(max(0, self.clock.now(host_ns) - self._next), GapReason.RESTART, host_ns)
            self.clock.begin(time_ns, self._next)
        elif ahead > TOLERANCE:
            self._tell(host_ns)
            self.counters["samples_lost"] += ahead
            self._gap(ahead, GapReason.OVERFLOW, host_ns)

    def _drain(self) -> None:
        """Discard waiting samples: without time stamps, the place of the loss is unknown."""
        self._tell(time.monotonic_ns())
        while self._reader.read(self._stream, None, 0).n > 0:
            continue
        self._missed = GapReason.OVERFLOW

    def _waited(self, host_ns: int) -> None:
        self._tell(host_ns)
        if host_ns - self._heard_ns < STALLED_S * 1e9:
            return
        if self._was_restarted:
            raise DriverError(f"it delivers no samples for {2 * STALLED_S:g} s")
        self.counters["stalls"] += 1
        self._stream.deactivate()
        self.resume(GapReason.RESTART)
        self._was_restarted = True

    def _tell(self, host_ns: int) -> None:
        """Hand over the current piece, even if it is not full, and begin the next."""
        n = self._at - self._begun
        if not n:
            return
        self._say(RxChunk(self._next - n, n, self._begun, host_ns, self._unsure, GapReason.NONE))
        self._begun, self._unsure = self._at, 0

    def _gap(self, n: int, reason: GapReason, host_ns: int) -> None:
        if not n:
            return
        self._unsure = 0 if self._has_time else self._piece
        self._say(RxChunk(self._next, n, 0, host_ns, self._unsure, reason))
        self._next += n
        self.clock.saw(self._next, host_ns)

    def _say(self, chunk: RxChunk) -> None:
        """Send a chunk to the daemon; if that fails, the next chunk's index reveals the loss."""
        try:
            self._rx_socket.send(pack_rx_chunk(chunk))
        except BlockingIOError:
            self._lost(chunk.n)

    def _lost(self, n: int) -> None:
        self.counters["overflows"] += 1
        self.counters["samples_lost"] += n


class _SampleReader:
    """Reads samples of any supported format as complex64."""

    def __init__(self, form: str, most: int) -> None:
        self._scratch: Samples = np.zeros(most, np.complex64)
        kind = {"CF32": None, "CS16": np.int16, "CS8": np.int8}[form]
        self._scale = np.float32(1 / 32768 if form == "CS16" else 1 / 128)
        self._raw: Values | None = None if kind is None else np.zeros((most, 2), kind)

    def read(self, stream: Stream, into: Samples | None, timeout_us: int) -> StreamResult:
        """Read samples into `into`, or discard them if it is None."""
        target = self._scratch if into is None else into
        if self._raw is None:
            return stream.read(target, timeout_us)
        raw = self._raw[: len(target)]
        result = stream.read(raw.reshape(-1).view(f"V{2 * raw.itemsize}"), timeout_us)
        if result.n > 0:
            parts = target[: result.n].view(np.float32).reshape(-1, 2)
            np.multiply(raw[: result.n], self._scale, out=parts)
        return result


def _check(n: int) -> None:
    if n < 0:
        raise DriverError(f"the stream failed ({ERRORS.get(n, n)})")
