"""The air between nodes, as a process: `python -m benchmarks.peers.pound.air RATE DEVICE [DEVICE]`.

It creates TAP devices in its namespace. A frame that a device sends is received when its airtime is
over: by the other device, which has an air of its own for the way back, or, where there is one
device only, by that device again: all of its stations share one air. Nothing interrupts a frame in
the air, and frames do not overlap.

RATE is in bit/s. "ready" is printed when the devices exist. They vanish with the process, which
ends with its parent. The standard library is enough.
"""

import collections
import contextlib
import fcntl
import math
import os
import select
import struct
import sys
import time

TUN = "/dev/net/tun"
SET_INTERFACE = 0x400454CA
TAP_WITHOUT_HEADER = 0x0002 | 0x1000
LARGEST = 1 << 16
SPIN_S = 0.00015
"""Time before the end of a frame in which to poll instead of sleep, because timers are late."""
PRIORITY = 1
"""Of real time, so before all ordinary programs: the air waits for nobody."""


class Line:
    """One direction: the frames in the air, and when each is received."""

    def __init__(self, into: int, rate_bps: float) -> None:
        self._into, self._rate_bps = into, rate_bps
        self._frames: collections.deque[tuple[float, bytes]] = collections.deque()
        self._free_at = 0.0

    @property
    def due(self) -> float:
        """When the next frame is over (monotonic s)."""
        return self._frames[0][0] if self._frames else math.inf

    def take(self, frame: bytes, now: float) -> None:
        """Send a frame as soon as the one before is over."""
        self._free_at = max(self._free_at, now) + 8 * len(frame) / self._rate_bps
        self._frames.append((self._free_at, frame))

    def deliver(self) -> None:
        """Let the next frame be received; a device that is down receives nothing."""
        _, frame = self._frames.popleft()
        with contextlib.suppress(OSError):
            os.write(self._into, frame)


def open_tap(name: str) -> int:
    """Create a TAP device; returns its file."""
    device = os.open(TUN, os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(device, SET_INTERFACE, struct.pack("16sH22x", name.encode(), TAP_WITHOUT_HEADER))
    return device


def carry(devices: list[int], rate_bps: float) -> None:
    """Carry frames until the input ends."""
    lines = {device: Line(into, rate_bps)
             for device, into in zip(devices, reversed(devices), strict=True)}  # fmt: skip
    inputs = [sys.stdin.fileno(), *devices]
    while True:
        due = min(line.due for line in lines.values())
        left = due - SPIN_S - time.monotonic()
        ready, *_ = select.select(inputs, [], [], None if due == math.inf else max(0.0, left))
        now = time.monotonic()
        for device in ready:
            if device not in lines:
                return
            # One that is down can be neither read nor waited for.
            with contextlib.suppress(BlockingIOError):
                lines[device].take(os.read(device, LARGEST), now)
        for line in lines.values():
            if line.due <= time.monotonic():
                line.deliver()


def main() -> None:
    """Create the devices, and carry."""
    rate_bps, *names = sys.argv[1:]
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    devices = [open_tap(name) for name in names]
    print("ready", flush=True)
    carry(devices, float(rate_bps))


if __name__ == "__main__":
    main()
