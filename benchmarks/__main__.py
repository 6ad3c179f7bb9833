"""All benchmarks that have rows, one after the other: `python -m benchmarks [--quick] [--json]`.

Whatever one of them misses or lacks, the next one runs. Options are given to each.
"""

import subprocess
import sys

from sdrlinkd.cli.benchmarks import BENCHMARKS


def main() -> int:
    """The exit code: 1 where a target was missed, or something could not be measured."""
    codes = []
    for name, benchmark in BENCHMARKS.items():
        if benchmark.has_rows:
            sys.stderr.write(f"{name}: {benchmark.sentence} About {benchmark.minutes:g} minutes.\n")
            command = [sys.executable, "-m", f"benchmarks.{name}", *sys.argv[1:]]
            codes.append(subprocess.run(command, check=False).returncode)
    return int(any(codes))


if __name__ == "__main__":
    sys.exit(main())
