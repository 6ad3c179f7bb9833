"""The Pound paper's experiments: `python -m benchmarks.pound [--quick] [--json] [--no-peers]`.

`--keep` keeps the rows, and what the figures show, for docs/benchmarks.md.
"""

import argparse
import sys
from collections.abc import Iterator

import numpy as np

from benchmarks.pound import beside, channel_rows, limits, pictures, realtime, rows, tables
from benchmarks.report import Drawing, Row, exactly, main

PHASES, QUICK_PHASES = 10, 2


def measure(seed: int, quick: bool, no_peers: bool = False) -> Iterator[Row | Drawing]:
    """Measure the rows of all experiments of the paper."""
    peers = [] if no_peers else beside.find(quick)
    n = tables.LASERS // 5 if quick else tables.LASERS
    flows = [
        [tables.flows(hops, tables.EXACT, seed, quick)[0]._replace(count=n),
         tables.flows(hops, tables.EXACT, seed, quick)[1]]
        for hops in (1, 2)
    ]  # fmt: skip
    rng = np.random.default_rng(seed)
    # Not in phase with the loop, where the order of arrival would be a matter of luck.
    phases = list(rng.uniform(0.002, 0.018, QUICK_PHASES if quick else PHASES))
    phases = [phase + 0.02 * i for i, phase in enumerate(phases)]
    sizes = (limits.SIZES[-1],) if quick else limits.SIZES
    one_hop = beside.tables(peers, flows[0], False, seed)
    two_hops = beside.tables(peers, flows[1], True, seed)
    one_channel = beside.one_channel(peers, flows[0], seed)
    mbps = beside.bandwidths(peers, sizes, 2.0 if quick else 4.0)
    loops = beside.loops(peers, phases)
    cut = [] if quick else peers
    table_5 = {
        2: beside.recoveries(cut, shared=True),
        3: beside.recoveries(cut, relay=True),
    }
    yield from exactly(rows.two_nodes(seed, quick, one_hop))
    yield from exactly(channel_rows.two_nodes(seed, quick, one_channel))
    yield from exactly(rows.three_nodes(seed, quick, two_hops))
    yield from exactly(rows.bandwidth(seed, quick, mbps))
    yield from exactly(rows.outage(seed, quick, beside.recoveries(cut)))
    yield from exactly(channel_rows.outage(seed, quick, table_5))
    yield from exactly(rows.control_loop(seed, phases, loops))
    yield from exactly(rows.urgent(seed, quick))
    yield from rows.costs(seed, quick)
    yield from exactly(rows.plan(seed, quick))
    yield from realtime.rows(seed, quick)
    if not (quick or no_peers):
        yield pictures.drawing(seed, one_hop, mbps, loops, phases[len(phases) // 2])


if __name__ == "__main__":
    own = argparse.ArgumentParser(add_help=False)
    own.add_argument("--no-peers", action="store_true", help="only our own rows")
    sys.exit(main("pound", measure, own))
