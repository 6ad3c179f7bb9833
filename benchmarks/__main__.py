"""Runs all benchmarks with rows in turn: `python -m benchmarks [--quick] [--json]`.

A benchmark that misses a target or cannot run does not stop the next one. The options apply to
each.
"""

import subprocess
import sys

from sdrlinkd.cli.benchmarks import BENCHMARKS


def main() -> int:
    """Run all benchmarks; returns 1 if a target was missed or something could not be measured."""
    codes = []
    for name, benchmark in BENCHMARKS.items():
        if benchmark.has_rows:
            sys.stderr.write(f"{name}: {benchmark.sentence} About {benchmark.minutes:g} minutes.\n")
            command = [sys.executable, "-m", f"benchmarks.{name}", *sys.argv[1:]]
            codes.append(subprocess.run(command, check=False).returncode)
    return int(any(codes))


if __name__ == "__main__":
    sys.exit(main())
