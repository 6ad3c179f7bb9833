"""Radios through SoapySDR in real time: `python -m benchmarks.radio [--quick] [--json]`.

The radio is the driver of tests/soapy_loopback, whose antenna is shared memory. It behaves like a
USRP or a HackRF, but has neither USB nor firmware, and its driver computes in the radio process
what a device would do by itself. Exits with 2 if the driver cannot be compiled.
"""

import sys
from collections.abc import Iterator

from benchmarks.absent import attempt
from benchmarks.loopback_radio import use_driver
from benchmarks.radio import load, odometry
from benchmarks.report import Row, main


def measure(seed: int, quick: bool) -> Iterator[Row]:
    """Measure the rows of load and odometry. Raises NoDriverError."""
    use_driver()
    with attempt("radios like a USRP"):
        yield from load.rows(seed, quick)
    with attempt("radios like a HackRF"):
        yield from odometry.rows(seed, quick)


if __name__ == "__main__":
    sys.exit(main("radio", measure))
