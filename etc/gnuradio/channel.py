#!/usr/bin/env python3
"""A simulated channel between daemons, as a GNU Radio flowgraph: raw samples over ZeroMQ.

Each node receives the sum of all others, plus noise.
"""

import argparse
import itertools
import math

import flowgraph
from gnuradio import analog, blocks, gr, zeromq

ENDS = {
    "push": (zeromq.pull_source, zeromq.push_sink),
    "pub": (zeromq.sub_source, zeromq.pub_sink),
    "req": (zeromq.req_source, zeromq.rep_sink),
}
FULL_SCALE = 32767.0
TIMEOUT_MS = 100


def options() -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument(
        "--node",
        nargs=2,
        action="append",
        required=True,
        metavar=("SEND", "RECEIVE"),
        help="endpoints of a node: it binds SEND, this binds RECEIVE; one --node for each",
    )
    parser.add_argument("--pattern", choices=ENDS, default="push", help="ZeroMQ socket pattern")
    parser.add_argument("--format", choices=("cf32", "sc16"), default="cf32", help="sample type")
    parser.add_argument("--rate", type=float, default=1e6, metavar="HZ")
    parser.add_argument("--snr-db", type=float, default=30.0, metavar="DB", help="SNR of a burst")
    parser.add_argument(
        "--power-dbfs", type=float, default=-12.0, metavar="DB", help="mean power of a burst"
    )
    parser.add_argument(
        "--cfo-hz",
        type=float,
        default=0.0,
        metavar="HZ",
        help="frequency offset between first and last node",
    )
    parser.add_argument("--delay", type=int, default=0, metavar="SAMPLES", help="propagation delay")
    parser.add_argument(
        "--block", type=int, default=512, metavar="SAMPLES", help="samples per block, in real time"
    )
    asked = parser.parse_args()
    if len(asked.node) < 2:
        parser.error("a channel needs two nodes: --node SEND RECEIVE --node SEND RECEIVE")
    return asked


class Channel(gr.top_block):
    """The flowgraph: the sources of all nodes, and for each node the sum of the others."""

    def __init__(self, asked: argparse.Namespace) -> None:
        gr.top_block.__init__(self, "channel")
        self._asked = asked
        silence = flowgraph.Silence(asked.rate, asked.block)
        noise = 10 ** ((asked.power_dbfs - asked.snr_db) / 20)
        last = len(asked.node) - 1
        carriers = [2 * math.pi * asked.cfo_hz / asked.rate * k / last for k in range(last + 1)]
        sent = [self._heard_of(send, w) for (send, _), w in zip(asked.node, carriers, strict=True)]
        for node, (_, receive) in enumerate(asked.node):
            total = blocks.add_cc()
            # Noise source seeds start at 1: 0 means the clock.
            source = analog.fastnoise_source_c(analog.GR_GAUSSIAN, noise, node + 1, 1 << 18)
            heard = [silence, source, *sent[:node], *sent[node + 1 :]]
            for port, part in enumerate(heard):
                self.connect(part, (total, port))
            self._tell(total, receive, carriers[node])

    def _heard_of(self, endpoint: str, carrier: float) -> gr.basic_block:
        """The signal that a node sends, on its carrier."""
        source, _ = ENDS[self._asked.pattern]
        if self._asked.format == "cf32":
            chain = [source(gr.sizeof_gr_complex, 1, endpoint, TIMEOUT_MS)]
        else:
            chain = [
                source(2 * gr.sizeof_short, 1, endpoint, TIMEOUT_MS),
                blocks.interleaved_short_to_complex(True, False, FULL_SCALE),
            ]
        if carrier:
            chain.append(blocks.rotator_cc(carrier))
        if self._asked.delay:
            chain.append(blocks.delay(gr.sizeof_gr_complex, self._asked.delay))
        self._chain(*chain)
        return chain[-1]

    def _tell(self, heard: gr.basic_block, endpoint: str, carrier: float) -> None:
        """Send a node what it hears, rotated by its own carrier."""
        _, sink = ENDS[self._asked.pattern]
        chain = [heard]
        if carrier:
            chain.append(blocks.rotator_cc(-carrier))
        if self._asked.format == "cf32":
            chain.append(sink(gr.sizeof_gr_complex, 1, endpoint, TIMEOUT_MS))
        else:
            chain += [
                blocks.complex_to_interleaved_short(True, FULL_SCALE),
                sink(2 * gr.sizeof_short, 1, endpoint, TIMEOUT_MS),
            ]
        self._chain(*chain)

    def _chain(self, *parts: gr.basic_block) -> None:
        for one, next_one in itertools.pairwise(parts):
            self.connect(one, next_one)


def main() -> None:
    """Run until SIGTERM or SIGINT."""
    flowgraph.run(Channel(options()))


if __name__ == "__main__":
    main()
