"""Common parts of the flowgraphs in this folder: pace, start and end."""

import os
import signal
import sys

import pmt
from gnuradio import analog, blocks, gr

gr.logging().set_default_level(gr.log_levels.warn)


class Silence(gr.hier_block2):
    """Zeros in real time; a stream that is added to them also runs in real time."""

    PERIOD_S, LONGEST = 0.5, 1 << 19
    AHEAD = 4096

    def __init__(self, rate_hz: float, at_once: int) -> None:
        gr.hier_block2.__init__(
            self, "silence", gr.io_signature(0, 0, 0), gr.io_signature(1, 1, gr.sizeof_gr_complex)
        )
        # A throttle counts from its start, so it would catch up after an hour of waiting. This tag
        # restarts it.
        again = (0, pmt.intern("rx_rate"), pmt.from_double(rate_hz), pmt.PMT_F)
        n = min(int(rate_hz * self.PERIOD_S), self.LONGEST)
        zeros = blocks.vector_source_c([0] * n, True, 1, [gr.tag_utils.python_to_tag(again)])
        throttle = blocks.throttle(gr.sizeof_gr_complex, rate_hz, False)
        throttle.set_max_noutput_items(at_once)
        throttle.set_max_output_buffer(self.AHEAD)
        self.connect(zeros, throttle, self)


class Air(gr.hier_block2):
    """Real time and noise; a sender's tags do not pass."""

    AT_ONCE = 4096

    def __init__(self, rate_hz: float, noise: float, seed: int) -> None:
        complex_items = gr.io_signature(1, 1, gr.sizeof_gr_complex)
        gr.hier_block2.__init__(self, "air", complex_items, complex_items)
        throttle = blocks.throttle(gr.sizeof_gr_complex, rate_hz, False)
        throttle.set_max_noutput_items(self.AT_ONCE)
        total = blocks.add_cc()
        self.connect(self, throttle, (total, 0))
        self.connect(
            analog.fastnoise_source_c(analog.GR_GAUSSIAN, noise, seed, 1 << 18), (total, 1)
        )
        self.connect(total, blocks.tag_gate(gr.sizeof_gr_complex, False), self)


def run(graph: gr.top_block, note: str = "") -> None:
    """Run the flowgraph until SIGTERM or SIGINT."""
    ends = {signal.SIGTERM, signal.SIGINT}
    signal.pthread_sigmask(signal.SIG_BLOCK, ends)
    with os.fdopen(os.dup(1), "w") as out:
        os.dup2(2, 1)  # GNU Radio logs there
        graph.start()
        if note:
            sys.stderr.write(f"{note}\n")
        out.write("ready\n")
        out.flush()
        signal.sigwait(ends)
    graph.stop()
    # Without wait(), because a sink that nobody reads never ends.
    os._exit(0)
