#!/usr/bin/env python3
"""GNU Radio's OFDM modem as the PHY of two daemons, or of one that hears itself.

PDUs come and go as PMT messages over ZeroMQ, or over UDP or TCP. SNR is that of the preamble.
"""

import argparse
import math

import daemons
import flowgraph
from gnuradio import digital, gr

FFT, PREFIX, DATA_CARRIERS, CARRIERS = 64, 16, 48, 52
PREAMBLE_AND_HEADER, CRC_BYTES = 3, 4
# Without samples after it, a burst stays in the receiver.
TAIL = 400


def options() -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    daemons.add_options(parser)
    parser.add_argument(
        "--bits", type=int, choices=(1, 2), default=1, help="bits per subcarrier: BPSK or QPSK"
    )
    return parser.parse_args()


def burst_samples(pdu_size: int, bits: int) -> int:
    """Number of samples from the start of one PDU to the start of the next."""
    symbols = math.ceil(8 * (pdu_size + CRC_BYTES) / (bits * DATA_CARRIERS))
    return (PREAMBLE_AND_HEADER + symbols) * (FFT + PREFIX) + TAIL


class Phy(gr.top_block):
    """The flowgraph: a modem, an air and a modem for each direction."""

    def __init__(self, asked: argparse.Namespace) -> None:
        gr.top_block.__init__(self, "ofdm_phy")
        for seed, (sender, hearer) in enumerate(daemons.pairs(self, asked), 1):
            send = digital.ofdm_tx(
                packet_length_tag_key=daemons.SENT, bps_payload=asked.bits, scramble_bits=True
            )
            hear = digital.ofdm_rx(
                frame_length_tag_key="frame_len",
                packet_length_tag_key=daemons.HEARD,
                bps_payload=asked.bits,
                scramble_bits=True,
            )
            tail = digital.burst_shaper_cc([1, 1], 0, TAIL, False, daemons.SENT)
            noise = math.sqrt(CARRIERS) * 10 ** (-asked.snr_db / 20)
            air = flowgraph.Air(asked.rate, noise, seed)
            self.connect(sender.sent(), send, tail, air, hear)
            hearer.hear(hear)


def main() -> None:
    """Run until SIGTERM or SIGINT."""
    asked = options()
    a_second = asked.rate / burst_samples(asked.pdu_size, asked.bits)
    flowgraph.run(Phy(asked), f"{a_second:.0f} PDUs of {asked.pdu_size} bytes a second at most")


if __name__ == "__main__":
    main()
