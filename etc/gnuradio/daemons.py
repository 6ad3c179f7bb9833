"""The points where a daemon's PDUs enter and leave a flowgraph."""

import argparse

import buffers  # noqa: F401
import pmt
from gnuradio import blocks, gr, network, pdu, zeromq

ENDS = {
    "push": (zeromq.pull_msg_source, zeromq.push_msg_sink),
    "pub": (zeromq.sub_msg_source, zeromq.pub_msg_sink),
}
SERVERS = {"udp": "UDP_SERVER", "tcp": "TCP_SERVER"}
# The keys differ, so that a sender's tags are not taken for a receiver's.
SENT, HEARD = "sent_len", "heard_len"
ARRIVED = "arrived_len"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that every PHY has."""
    air = parser.add_mutually_exclusive_group(required=True)
    air.add_argument(
        "--link",
        nargs="+",
        metavar="ENDPOINT",
        help="two daemons, full duplex: A_SEND A_RECEIVE B_SEND B_RECEIVE; udp, tcp: A B",
    )
    air.add_argument(
        "--loop",
        nargs="+",
        metavar="ENDPOINT",
        help="one daemon that hears itself: SEND RECEIVE; udp, tcp: HOST:PORT",
    )
    parser.add_argument("--transport", choices=("zeromq", *SERVERS), default="zeromq")
    parser.add_argument("--pattern", choices=ENDS, default="push", help="ZeroMQ socket pattern")
    parser.add_argument(
        "--pdu-size", type=int, default=1024, metavar="BYTES", help="largest PDU; tcp: every PDU"
    )
    parser.add_argument("--rate", type=float, default=1e6, metavar="HZ")
    parser.add_argument("--snr-db", type=float, default=25.0, metavar="DB")


class Daemon:
    """A daemon's connection to a flowgraph."""

    def __init__(self, graph: gr.top_block, asked: argparse.Namespace, *endpoints: str) -> None:
        self._graph = graph
        # A throttle counts from its start, so it would catch up after silence. This tag on a PDU's
        # burst restarts it.
        self._paced = pdu.pdu_set(pmt.intern("rx_rate"), pmt.from_double(asked.rate))
        self._cut = asked.pdu_size if asked.transport == "tcp" else 0
        if asked.transport == "zeromq":
            source, sink = ENDS[asked.pattern]
            send, receive = endpoints
            self._source, self._out = source(send), "out"
            self._sink, self._in = sink(receive), "in"
        else:
            host, _, port = endpoints[0].rpartition(":")
            server = network.socket_pdu(SERVERS[asked.transport], host, port)
            self._source = self._sink = server
            self._out = self._in = "pdus"

    def sent(self) -> gr.basic_block:
        """The bytes of the daemon's PDUs, each PDU tagged with its length."""
        stream = pdu.pdu_to_tagged_stream(gr.types.byte_t, ARRIVED if self._cut else SENT)
        self._graph.msg_connect(self._source, self._out, self._paced, "pdus")
        self._graph.msg_connect(self._paced, "pdus", stream, "pdus")
        if not self._cut:
            return stream
        # TCP does not keep PDU boundaries: the received stream is cut into PDUs.
        cut = blocks.stream_to_tagged_stream(gr.sizeof_char, 1, self._cut, SENT)
        self._graph.connect(stream, cut)
        return cut

    def hear(self, stream: gr.basic_block) -> None:
        """Give the daemon the PDUs in a stream of bytes."""
        pdus = pdu.tagged_stream_to_pdu(gr.types.byte_t, HEARD)
        self._graph.connect(stream, pdus)
        self._graph.msg_connect(pdus, "pdus", self._sink, self._in)


def pairs(graph: gr.top_block, asked: argparse.Namespace) -> list[tuple[Daemon, Daemon]]:
    """The pairs of sender and receiver."""
    each = 2 if asked.transport == "zeromq" else 1
    named = asked.link or asked.loop
    if len(named) != (2 * each if asked.link else each):
        raise SystemExit(f"{asked.transport} wants {each} endpoints for each daemon")
    ends = [Daemon(graph, asked, *named[k : k + each]) for k in range(0, len(named), each)]
    return list(zip(ends, reversed(ends), strict=True))
