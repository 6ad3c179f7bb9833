"""Samples in memory that daemon and radio process share."""

import contextlib
import mmap
import os

import numpy as np

from backends.base import Samples

_PAGE = mmap.PAGESIZE

RX_RING_S, TX_RING_S = 0.5, 0.1
LEAST_RING = 1 << 19


def ring_sizes(rate_hz: float, longest_s: float, lead_s: float) -> tuple[int, int]:
    """Samples of a receive and of a transmit ring, for bursts of at most `longest_s`."""
    rx = max(LEAST_RING, round(RX_RING_S * rate_hz))
    # In any case the burst that leaves and the next one.
    tx = max(LEAST_RING, round((2 * longest_s + TX_RING_S + lead_s) * rate_hz))
    return rx, tx


class SampleRing:
    """`capacity` samples, written by one process in order and read by another.

    The reader says in `tail` how many it is done with since the beginning; what was written is told
    by messages, whose way through the kernel also orders the memory.
    """

    def __init__(self, fd: int, capacity: int) -> None:
        self.capacity = capacity
        self._map = mmap.mmap(fd, _PAGE + 8 * capacity)
        self._tail = np.frombuffer(self._map, np.int64, 1)
        self._samples: Samples = np.frombuffer(self._map, np.complex64, capacity, _PAGE)

    @property
    def tail(self) -> int:
        """The number of samples that the reader is done with since the beginning."""
        return int(self._tail[0])

    @tail.setter
    def tail(self, n: int) -> None:
        self._tail[0] = n

    def close(self) -> None:
        """Give the memory back, as soon as nobody looks at samples in it; closing twice is fine."""
        self._tail = np.zeros(1, np.int64)
        self._samples = np.zeros(0, np.complex64)
        with contextlib.suppress(BufferError):
            self._map.close()

    def view(self, first: int, n: int) -> Samples:
        """Up to `n` samples from the `first` ever on; fewer at the ring's end."""
        at = first % self.capacity
        return self._samples[at : at + n]

    def whole(self, first: int, n: int) -> int:
        """The first place at or behind `first` where `n` samples lie in one piece."""
        at = first % self.capacity
        return first if at + n <= self.capacity else first + self.capacity - at


def make_shared(capacity: int, name: str) -> int:
    """A file descriptor of memory for so many samples; gone with the last process that has it."""
    fd = os.memfd_create(f"sdrlinkd-{name}")
    os.ftruncate(fd, _PAGE + 8 * capacity)
    return fd
