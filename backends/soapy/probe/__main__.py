"""The process that looks: `python -m backends.soapy.probe ARGS` prints a report as JSON.

A line of its own comes before it, for drivers print what they like.
"""

import sys

import msgspec

from backends.soapy.probe.enumeration import enumerate_devices

if __name__ == "__main__":
    report = enumerate_devices(sys.argv[1])
    sys.stdout.buffer.write(b"\n" + msgspec.json.encode(report) + b"\n")
