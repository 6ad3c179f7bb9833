"""The probing process: `python -m backends.soapy.probe ARGS` prints a report as JSON.

A newline precedes the report, because drivers print whatever they like.
"""

import sys

import msgspec

from backends.soapy.probe.enumeration import enumerate_devices

if __name__ == "__main__":
    report = enumerate_devices(sys.argv[1])
    sys.stdout.buffer.write(b"\n" + msgspec.json.encode(report) + b"\n")
