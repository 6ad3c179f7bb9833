"""Samples in memory that the daemon and its radio process share."""

import contextlib
import mmap
import os

import numpy as np

from backends.base import Samples

_PAGE = mmap.PAGESIZE

RX_RING_S, TX_RING_S = 0.5, 0.1
LEAST_RING = 1 << 19


def ring_sizes(rate_hz: float, longest_s: float, lead_s: float) -> tuple[int, int]:
    """Capacities of the receive and the transmit ring, for bursts of at most `longest_s`."""
    rx = max(LEAST_RING, round(RX_RING_S * rate_hz))
    # Always room for the burst on the air and the next one.
    tx = max(LEAST_RING, round((2 * longest_s + TX_RING_S + lead_s) * rate_hz))
    return rx, tx


class SampleRing:
    """A ring of `capacity` samples, written in order by one process and read by another.

    The reader sets `tail` to the number of samples that it has finished since the beginning. The
    writer announces samples by messages; their passage through the kernel also orders the memory
    accesses.
    """

    def __init__(self, fd: int, capacity: int) -> None:
        self.capacity = capacity
        self._map = mmap.mmap(fd, _PAGE + 8 * capacity)
        self._tail = np.frombuffer(self._map, np.int64, 1)
        self._samples: Samples = np.frombuffer(self._map, np.complex64, capacity, _PAGE)

    @property
    def tail(self) -> int:
        """Number of samples that the reader has finished since the beginning."""
        return int(self._tail[0])

    @tail.setter
    def tail(self, n: int) -> None:
        self._tail[0] = n

    def close(self) -> None:
        """Free the memory as soon as no view of its samples is left; closing twice is fine."""
        self._tail = np.zeros(1, np.int64)
        self._samples = np.zeros(0, np.complex64)
        with contextlib.suppress(BufferError):
            self._map.close()

    def view(self, first: int, n: int) -> Samples:
        """Up to `n` samples from position `first` (never wraps) on; fewer at the ring's end."""
        at = first % self.capacity
        return self._samples[at : at + n]

    def whole(self, first: int, n: int) -> int:
        """The first position from `first` on at which `n` samples are contiguous."""
        at = first % self.capacity
        return first if at + n <= self.capacity else first + self.capacity - at


def make_shared(capacity: int, name: str) -> int:
    """Descriptor of memory for `capacity` samples; freed with the last process that holds it."""
    fd = os.memfd_create(f"sdrlinkd-{name}")
    os.ftruncate(fd, _PAGE + 8 * capacity)
    return fd
