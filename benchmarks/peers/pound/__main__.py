"""Laser and image through each peer: `python -m benchmarks.peers.pound [--peer NAME] [--json]`."""

import argparse
import json
import signal
import sys
from collections.abc import Iterator

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from benchmarks.absent import FAILURES
from benchmarks.flows import Figures, Flow, figures
from benchmarks.peers.pound.namespaces import available, network
from benchmarks.peers.pound.runs import run_peer
from benchmarks.peers.pound.table import PEERS

IMAGE_PERIOD_S = {False: 0.15, True: 0.3}
"""Image period without and with a relay, which halves the channel's capacity."""

Result = dict[str, Figures] | str
"""The figures by flow, or why there are none."""


def flows(lasers: int, relay: bool) -> list[Flow]:
    """The paper's two flows, over the same time."""
    period_s = IMAGE_PERIOD_S[relay]
    return [
        Flow("laser", 1024, 0.02, lasers, "latency"),
        Flow("image", 65536, period_s, max(1, int(lasers * 0.02 / period_s)), "bulk"),
    ]


def measure(names: list[str], options: argparse.Namespace) -> Iterator[tuple[str, Result]]:
    """Measure each peer in turn, each on a network of its own."""
    for name in names:
        try:
            with network(shared=options.shared, relay=options.relay) as on:
                told = run_peer(name, flows(options.lasers, options.relay), on, options.seed)
            yield name, {trace.flow.name: figures(trace) for trace in told}
        except FAILURES as error:
            yield name, str(error)


def table(results: dict[str, dict[str, Figures]]) -> Table:
    """All figures as a table for people."""
    made = Table(title="laser and image through each peer", title_justify="left")
    for column in ("peer", "imitates", "flow"):
        made.add_column(column)
    for column in ("Jd ms", "std(Jd)", "D ms", "std(D)", "MDR %", "Mbit/s"):
        made.add_column(column, justify="right")
    for flow in ("laser", "image"):
        for name, result in results.items():
            *times, mbps = result[flow]
            made.add_row(
                name, PEERS[name].of, flow, *(f"{value:.1f}" for value in times), f"{mbps:.3f}"
            )
        made.add_section()
    return made


def main() -> int:
    """Parse, measure, print; returns 1 if no peer could be measured."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.peers.pound", description=__doc__)
    parser.add_argument("--peer", action="append", choices=[*PEERS], help="only this one; repeat")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--lasers", type=int, default=1000, help="messages, 20 ms apart")
    parser.add_argument("--shared", action="store_true", help="one channel for both directions")
    parser.add_argument("--relay", action="store_true", help="three nodes in a chain")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    # Like an interrupt: runs all cleanup handlers.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    names = options.peer or [*PEERS]
    results: dict[str, Result] = {}
    console = Console(stderr=True)
    if reason := available():
        console.print(f"no test network: {reason}")
        return 1
    with Progress(console=console, transient=True) as progress:
        bar = progress.add_task(names[0], total=len(names))
        for i, (name, result) in enumerate(measure(names, options), 1):
            results[name] = result
            progress.update(bar, completed=i, description=names[min(i, len(names) - 1)])
    measured = {name: result for name, result in results.items() if not isinstance(result, str)}
    if options.json:
        told = {
            name: result
            if isinstance(result, str)
            else {flow: of._asdict() for flow, of in result.items()}
            for name, result in results.items()
        }
        sys.stdout.write(json.dumps(told, indent=2) + "\n")
    else:
        (Console() if sys.stdout.isatty() else Console(width=120)).print(table(measured))
    for result in results.values():
        if isinstance(result, str):
            console.print(f"not measured: {result}")
    return 0 if measured else 1


if __name__ == "__main__":
    raise SystemExit(main())
