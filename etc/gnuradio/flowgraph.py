"""What the flowgraphs of this folder share: pace, start and end."""

import signal
import sys

import pmt
from gnuradio import blocks, gr


class Silence(gr.hier_block2):
    """Zeros in real time: what is added to them comes in real time, too."""

    PERIOD_S = 0.5

    def __init__(self, rate_hz: float) -> None:
        gr.hier_block2.__init__(
            self, "silence", gr.io_signature(0, 0, 0), gr.io_signature(1, 1, gr.sizeof_gr_complex)
        )
        # A throttle counts from its start: an hour of waiting would be an hour to catch up with.
        # This tag starts it anew.
        again = (0, pmt.intern("rx_rate"), pmt.from_double(rate_hz), pmt.PMT_F)
        zeros = blocks.vector_source_c(
            [0] * int(rate_hz * self.PERIOD_S), True, 1, [gr.tag_utils.python_to_tag(again)]
        )
        throttle = blocks.throttle(gr.sizeof_gr_complex, rate_hz, False)
        self.connect(zeros, throttle, self)


def run(graph: gr.top_block, max_items: int) -> None:
    """Until SIGTERM or SIGINT; no block does more than `max_items` at once."""
    ends = {signal.SIGTERM, signal.SIGINT}
    signal.pthread_sigmask(signal.SIG_BLOCK, ends)
    graph.start(max_items)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    signal.sigwait(ends)
    graph.stop()
    graph.wait()
