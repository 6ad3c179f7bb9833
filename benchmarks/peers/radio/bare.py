"""Peers: a receiving thread in a busy process, with SoapySDR's C library; and GNU Radio.

`python -m benchmarks.peers.radio.bare DEVICE SECONDS CHUNK SWITCH_S RATE_HZ…` prints the samples
lost at each rate.
"""

import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from backends.soapy.binding import HAS_TIME, OVERFLOW, RX, TIMEOUT, load_native_library
from benchmarks.absent import attempt
from benchmarks.loopback_radio import a_bus
from benchmarks.processes import told_by

WAYS = {"thread": (4096, 5e-3), "tuned_thread": (65536, 5e-4)}
"""Samples per read, and the time slice that Python gives a thread."""
THREADS = (
    "thread: one robot's receiver alone, 4096 samples per read, with a busy main thread in pure "
    "Python; tuned_thread: 65536 and a thread switch every 0.5 ms; both scaled to our time"
)
DEVICE = "driver=loopback,bus={bus},model=usrp"
TIMEOUT_US = 100_000
SYSTEM_PYTHON = "/usr/bin/python3"
FLOWGRAPH = Path(__file__).with_name("flowgraph.py")


def lost_in_threads(rates_msps: Sequence[int], seconds: float) -> dict[str, dict[int, float]]:
    """Samples per second that each peer loses, by rate."""
    module = [sys.executable, "-m", "benchmarks.peers.radio.bare"]
    lost = {}
    for name, numbers in WAYS.items():
        with attempt(f"SoapySDR in a {name}"):
            told = _told(module, rates_msps, seconds, *numbers)
            lost[name] = {each: n / seconds for each, n in told.items()}
    return lost


def flowgraph_cpu_pct(rates_msps: Sequence[int], seconds: float) -> dict[int, float]:
    """CPU load of each radio in % of one core, by rate; empty without GNU Radio."""
    with attempt("GNU Radio"):
        return _told([SYSTEM_PYTHON, str(FLOWGRAPH)], rates_msps, seconds)
    return {}


def _told(
    program: list[str], rates_msps: Sequence[int], seconds: float, *numbers: float
) -> dict[int, float]:
    """One figure per rate, from the last line that the program prints."""
    given = map(str, (seconds, *numbers, *(1e6 * each for each in rates_msps)))
    with a_bus() as bus:
        command = [*program, DEVICE.format(bus=bus), *given]
        lines = told_by(Path(program[-1]).name, *command).splitlines()
    figures = (lines or [""])[-1].split()
    return dict(zip(rates_msps, map(float, figures), strict=True))


class _Counting:
    """Receives, and counts the samples missing between the first and the last stamp."""

    def __init__(self, device: str, rate_hz: float, chunk: int) -> None:
        self._rate_hz = rate_hz
        self._chunk = chunk
        self._handle = load_native_library().make(device)
        self._handle.call("setSampleRate", RX, 0, rate_hz)
        self.lost = 0

    def run(self, seconds: float) -> None:
        """Receive for that time, and count what is missing."""
        stream = self._handle.open_stream(RX, 0, "CF32", {})
        into = np.zeros(self._chunk, np.complex64)
        stream.activate()
        until = time.monotonic() + seconds
        first_ns, read = 0, 0
        while time.monotonic() < until:
            result = stream.read(into, TIMEOUT_US)
            if result.n > 0 and result.flags & HAS_TIME:
                first_ns = first_ns or result.time_ns
                self.lost = round(1e-9 * (result.time_ns - first_ns) * self._rate_hz) - read
                read += result.n
            elif result.n not in (OVERFLOW, TIMEOUT):
                raise RuntimeError(f"the stream failed: {result}")
        stream.deactivate()
        stream.close()
        self._handle.close()


def main() -> None:
    """Receive while the main thread never waits."""
    device = sys.argv[1]
    seconds, chunk, switch_s, *rates_hz = (float(each) for each in sys.argv[2:])
    sys.setswitchinterval(switch_s)
    lost = []
    for rate_hz in rates_hz:
        counting = _Counting(device, rate_hz, round(chunk))
        thread = threading.Thread(target=counting.run, args=(seconds,))
        thread.start()
        turns = 0
        while thread.is_alive():
            turns += 1
        lost.append(counting.lost)
    print(*lost)


if __name__ == "__main__":
    main()
