#!/usr/bin/env python3
"""GNU Radio's GFSK modem as the PHY of two daemons, or of one that hears itself.

PDUs come and go as PMT messages over ZeroMQ, or over UDP or TCP. A frame is a preamble, an access
code, the length (sent twice), and the PDU with a CRC-32, whitened.
"""

import argparse
import math

import daemons
import flowgraph
import pmt
from gnuradio import blocks, digital, gr
from gnuradio.digital import packet_utils

PREAMBLE = b"\xaa" * 16
# The filters delay the last bits; without these they would stay inside.
POSTAMBLE = b"\xaa" * 4
ACCESS_CODE = packet_utils.default_access_code
WRONG_BITS = 4
LENGTH_BYTES, CRC_BYTES = 4, 4
# Without samples after it, a burst stays in the receiver.
TAIL = 400
BANDWIDTH_TIME = 0.5


def options() -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    daemons.add_options(parser)
    parser.add_argument("--samples", type=int, default=4, metavar="N", help="samples per bit")
    return parser.parse_args()


def burst_samples(pdu_size: int, samples: int) -> int:
    """Number of samples from the start of one PDU to the start of the next."""
    around = len(PREAMBLE) + len(ACCESS_CODE) // 8 + LENGTH_BYTES + CRC_BYTES + len(POSTAMBLE)
    return 8 * samples * (around + pdu_size) + TAIL


def always(octets: bytes) -> gr.basic_block:
    """A source that yields `octets` for each frame."""
    length = (0, pmt.intern(daemons.SENT), pmt.from_long(len(octets)), pmt.PMT_F)
    return blocks.vector_source_b(list(octets), True, 1, [gr.tag_utils.python_to_tag(length)])


def whitener(tag: str) -> gr.basic_block:
    """A block that whitens and dewhitens; it restarts at each tag."""
    return digital.additive_scrambler_bb(0x8A, 0x7F, 7, 0, 8, tag)


class Sender(gr.hier_block2):
    """Converts bytes of PDUs to samples."""

    def __init__(self, samples: int, sensitivity: float) -> None:
        gr.hier_block2.__init__(
            self,
            "gfsk_sender",
            gr.io_signature(1, 1, gr.sizeof_char),
            gr.io_signature(1, 1, gr.sizeof_gr_complex),
        )
        tag = daemons.SENT
        body = digital.crc32_bb(False, tag)
        white = whitener(tag)
        head = digital.protocol_formatter_bb(digital.header_format_default(ACCESS_CODE, 0), tag)
        frame = blocks.tagged_stream_mux(gr.sizeof_char, tag)
        self.connect(self, body, white)
        self.connect(body, head)
        for port, part in enumerate((always(PREAMBLE), head, white, always(POSTAMBLE))):
            self.connect(part, (frame, port))
        self.connect(
            frame,
            digital.gfsk_mod(samples, sensitivity, BANDWIDTH_TIME),
            blocks.tagged_stream_multiply_length(gr.sizeof_gr_complex, tag, 8 * samples),
            digital.burst_shaper_cc([1, 1], 0, TAIL, False, tag),
            self,
        )


class Hearer(gr.hier_block2):
    """Converts samples to bytes of PDUs."""

    def __init__(self, samples: int, sensitivity: float) -> None:
        gr.hier_block2.__init__(
            self,
            "gfsk_hearer",
            gr.io_signature(1, 1, gr.sizeof_gr_complex),
            gr.io_signature(1, 1, gr.sizeof_char),
        )
        tag = daemons.HEARD
        self.connect(
            self,
            digital.gfsk_demod(samples, sensitivity),
            digital.correlate_access_code_bb_ts(ACCESS_CODE, WRONG_BITS, tag),
            blocks.repack_bits_bb(1, 8, tag, False, gr.GR_MSB_FIRST),
            whitener(tag),
            digital.crc32_bb(True, tag),
            self,
        )


class Phy(gr.top_block):
    """The flowgraph: a modem, an air and a modem for each direction."""

    def __init__(self, asked: argparse.Namespace) -> None:
        gr.top_block.__init__(self, "gfsk_phy")
        sensitivity = math.pi / asked.samples
        noise = 10 ** (-asked.snr_db / 20)
        for seed, (sender, hearer) in enumerate(daemons.pairs(self, asked), 1):
            send = Sender(asked.samples, sensitivity)
            hear = Hearer(asked.samples, sensitivity)
            self.connect(sender.sent(), send, flowgraph.Air(asked.rate, noise, seed), hear)
            hearer.hear(hear)


def main() -> None:
    """Run until SIGTERM or SIGINT."""
    asked = options()
    a_second = asked.rate / burst_samples(asked.pdu_size, asked.samples)
    flowgraph.run(Phy(asked), f"{a_second:.0f} PDUs of {asked.pdu_size} bytes a second at most")


if __name__ == "__main__":
    main()
