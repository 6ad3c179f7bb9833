"""Radios by SoapySDR in real time: `python -m benchmarks.radio [--quick] [--json]`.

The radio is the driver of tests/soapy_loopback, whose antenna is shared memory. It has the ways of
a USRP or a HackRF, but neither USB nor firmware, and its driver computes in the radio process what
a device would do by itself. 2 where it cannot be compiled.
"""

import sys

from benchmarks.loopback_radio import NoDriverError, use_driver
from benchmarks.radio import load, odometry
from benchmarks.report import Row, main


def measure(seed: int, quick: bool) -> list[Row]:
    """All rows. Raises NoDriverError."""
    use_driver()
    return [*load.rows(seed, quick), *odometry.rows(seed, quick)]


if __name__ == "__main__":
    try:
        sys.exit(main("radio", measure))
    except NoDriverError as error:
        sys.stderr.write(f"not measured: the test radio: {error}\n")
        sys.exit(2)
