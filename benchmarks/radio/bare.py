"""A peer: who receives in a thread of a busy process, by SoapySDR's C library.

`python -m benchmarks.radio.bare DEVICE RATE_HZ SECONDS CHUNK SWITCH_S` prints the samples lost.
"""

import subprocess
import sys
import threading
import time

import numpy as np

from backends.soapy.native import NativeLibrary
from backends.soapy.surface import HAS_TIME, OVERFLOW, RX, TIMEOUT
from benchmarks.radio.driver import a_bus

WAYS = {"thread": (4096, 5e-3), "tuned_thread": (65536, 5e-4)}
"""Samples of a read, and how long Python lets a thread run; what is tuned comes last."""
SHARE = 0.25
NOTE = (
    "thread: receives 4096 samples a read and nothing else, beside a main thread of pure Python; "
    "tuned: 65536, and threads take turns every 0.5 ms; measured for a quarter of the time, and "
    "scaled"
)
TIMEOUT_US = 100_000


def peers(msps: int, seconds: float) -> dict[str, float]:
    """Samples that each would have lost."""
    return {
        name: _lost(1e6 * msps, SHARE * seconds, chunk, switch_s) / SHARE
        for name, (chunk, switch_s) in WAYS.items()
    }


def _lost(rate_hz: float, seconds: float, chunk: int, switch_s: float) -> int:
    with a_bus() as bus:
        device = f"driver=loopback,bus={bus},model=usrp"
        numbers = map(str, (rate_hz, seconds, chunk, switch_s))
        command = [sys.executable, "-m", "benchmarks.radio.bare", device, *numbers]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    return int(done.stdout)


class _Counting:
    """Receives; what is missing between the first and the last stamp was lost."""

    def __init__(self, device: str, rate_hz: float, chunk: int) -> None:
        self._rate_hz = rate_hz
        self._chunk = chunk
        self._handle = NativeLibrary().make(device)
        self._handle.call("setSampleRate", RX, 0, rate_hz)
        self.lost = 0

    def run(self, seconds: float) -> None:
        """Until then."""
        stream = self._handle.open_stream(RX, 0, "CF32", {})
        into = np.zeros(self._chunk, np.complex64)
        stream.activate()
        until = time.monotonic() + seconds
        first_ns, read = 0, 0
        while time.monotonic() < until:
            moved = stream.read(into, TIMEOUT_US)
            if moved.n > 0 and moved.flags & HAS_TIME:
                first_ns = first_ns or moved.time_ns
                self.lost = round(1e-9 * (moved.time_ns - first_ns) * self._rate_hz) - read
                read += moved.n
            elif moved.n not in (OVERFLOW, TIMEOUT):
                raise RuntimeError(f"the stream failed: {moved}")
        stream.deactivate()
        stream.close()
        self._handle.close()


def main() -> None:
    """Receive beside a main thread that never waits."""
    device = sys.argv[1]
    rate_hz, seconds, chunk, switch_s = (float(each) for each in sys.argv[2:6])
    sys.setswitchinterval(switch_s)
    counting = _Counting(device, rate_hz, round(chunk))
    thread = threading.Thread(target=counting.run, args=(seconds,))
    thread.start()
    turns = 0
    while thread.is_alive():
        turns += 1
    print(counting.lost)


if __name__ == "__main__":
    main()
