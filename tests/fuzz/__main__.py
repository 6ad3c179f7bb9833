"""Fuzzes what reads from outside, one target after the other."""

import argparse
import os
import re
import subprocess
import sys
from pathlib import Path
from random import Random

CRASHES = Path("build") / "fuzz"
CORPUS = Path(__file__).parent / "corpus"
LONGEST = {
    "link": 1024, "config": 8192, "sigmf": 4096, "sealed": 256, "foxglove": 16384, "cdr": 4096,
    "zenoh": 2048, "rmw_zenoh": 2048, "state": 4096,
}  # fmt: skip
USUAL = 512
"""Most octets of an input."""


def search(name: str, seconds: int) -> None:
    """Fuzz one target in this process, which libFuzzer ends."""
    import atheris  # only where it runs

    with atheris.instrument_imports(include=["sdrlinkd", "backends", "sdrlink_ros"]):
        from tests.fuzz.mutate import mutate
        from tests.fuzz.targets import TARGETS
    found = CRASHES / name
    found.mkdir(parents=True, exist_ok=True)
    grown = CRASHES / "corpus" / name
    grown.mkdir(parents=True, exist_ok=True)

    def changed(data: bytes, most: int, seed: int) -> bytes:
        return mutate(name, data, Random(seed))[:most]

    atheris.Setup(
        [
            sys.argv[0], f"-max_total_time={seconds}", f"-max_len={LONGEST.get(name, USUAL)}",
            f"-artifact_prefix={found}/", "-rss_limit_mb=1024", "-timeout=10",
            "-print_final_stats=1", str(grown), str(CORPUS / name),
        ],
        TARGETS[name],
        custom_mutator=changed,
    )  # fmt: skip
    atheris.Fuzz()


def main(arguments: list[str]) -> int:
    """Fuzz the targets named, or all; returns 1 if an input crashed one."""
    known = sorted(each.name for each in CORPUS.iterdir())
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("seconds", nargs="?", type=int, default=60, help="time for each target")
    parser.add_argument("target", nargs="*", help=f"of {', '.join(known)}; default: all")
    asked = parser.parse_args(arguments)
    unknown = sorted(set(asked.target) - set(known))
    if unknown:
        parser.error(f"no target {', '.join(unknown)}; there are {', '.join(known)}")
    seconds, failed = asked.seconds, False
    for name in asked.target or known:
        print(f"{name}: {seconds} s", flush=True)  # noqa: T201
        environment = {**os.environ, "SDRLINK_FUZZ": name}
        done = subprocess.run(
            [sys.executable, "-m", "tests.fuzz", str(seconds)],
            env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip
        executions = re.search(r"number_of_executed_units: +(\d+)", done.stderr)
        crashed = done.returncode != 0 or executions is None
        failed = failed or crashed
        told = executions.group(1) if executions else "unknown"
        print(f"{name}: {told} executions, {int(crashed)} crashes", flush=True)  # noqa: T201
        if crashed:
            sys.stderr.write("\n".join(done.stderr.splitlines()[-40:]) + "\n")
    return int(failed)


if __name__ == "__main__":
    target = os.environ.get("SDRLINK_FUZZ")
    if target:
        search(target, int(sys.argv[1]))
    else:
        sys.exit(main(sys.argv[1:]))
