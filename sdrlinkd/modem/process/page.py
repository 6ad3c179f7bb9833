"""What the modem process shows its daemon without a message: a page of shared memory.

The process writes the last block and the state of the channel after every block, a thousand times a
second; the daemon reads them when it decides. A CRC tells a record that was read while it was
written, whatever order the processor keeps between two processes.
"""

import mmap
import struct
import zlib
from typing import NamedTuple

from sdrlinkd.link import Sensed
from sdrlinkd.modem.clock import Seen

MOST_PULSES = 16
_RECORD = struct.Struct(f"<qdddddddq{MOST_PULSES}d")
_CRC = struct.Struct("<I")
_SIZE = _RECORD.size + _CRC.size
_BEAT, _WAKES = 512, 520
_TIME = struct.Struct("<d")
_NOWHERE = float("nan")
TRIES = 100


class Shown(NamedTuple):
    """What the process has shown last."""

    seen: Seen
    sensed: Sensed
    n_samples: int
    """Samples received, without gaps."""


class Page:
    """The page behind descriptor `fd`; each field is written by one side only."""

    def __init__(self, fd: int) -> None:
        self._memory = mmap.mmap(fd, mmap.PAGESIZE)
        self._last: Shown | None = None

    def show(self, seen: Seen, sensed: Sensed, n_samples: int) -> None:
        """Write the last block, the state of the channel, and how many samples were received."""
        until, idle_since, burst_at, carrier_end, carrier_at, pulses = sensed
        times = (until, idle_since, _told(burst_at), carrier_end, _told(carrier_at))
        padded = (*pulses[-MOST_PULSES:], *[_NOWHERE] * (MOST_PULSES - len(pulses)))
        record = _RECORD.pack(*seen, *times, n_samples, *padded)
        self._memory[:_SIZE] = record + _CRC.pack(zlib.crc32(record))

    def read(self) -> Shown | None:
        """What `show` has written; None: no block yet."""
        for _ in range(TRIES):
            data = self._memory[:_SIZE]
            record = data[: _RECORD.size]
            if zlib.crc32(record) == _CRC.unpack_from(data, _RECORD.size)[0]:
                self._last = _shown(record)
                break
            if not any(data):
                break
        return self._last

    def beat(self, now_s: float) -> None:
        """Note that the process was alive at monotonic time `now_s`."""
        _TIME.pack_into(self._memory, _BEAT, now_s)

    @property
    def beat_s(self) -> float:
        """Monotonic time at which the process was last alive; 0: never."""
        beat: float = _TIME.unpack_from(self._memory, _BEAT)[0]
        return beat

    @property
    def wakes(self) -> bool:
        """Whether the daemon wants a message after every block."""
        return bool(self._memory[_WAKES])

    @wakes.setter
    def wakes(self, value: bool) -> None:
        self._memory[_WAKES] = value

    def close(self) -> None:
        """Free the page."""
        self._memory.close()


def _shown(record: bytes) -> Shown:
    end, host_s, late_s, until, idle_since, burst_at, carrier_end, carrier_at, n, *pulses = (
        _RECORD.unpack(record)
    )
    sensed = Sensed(
        until, idle_since, _at(burst_at), carrier_end, _at(carrier_at),
        tuple(each for each in pulses if each == each),
    )  # fmt: skip
    return Shown(Seen(end, host_s, late_s), sensed, n)


def _told(at: float | None) -> float:
    """A time as it is written."""
    return _NOWHERE if at is None else at


def _at(told: float) -> float | None:
    """A time as it was written; NaN differs from itself."""
    return None if told != told else told
