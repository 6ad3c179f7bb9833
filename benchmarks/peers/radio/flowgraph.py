"""GNU Radio's own SoapySDR blocks, run by GNU Radio's interpreter.

    python3 flowgraph.py DEVICE SECONDS RATE_HZ…   CPU time of a radio in % of real time, by rate

Two radios that hear each other discard what they receive and send zeros without a pause; CPU time
is that of all threads, halved.
"""

import sys
import time

from gnuradio import blocks, gr, soapy

SETTLE_S = 0.5
NO_ARGS = ("", [""], [""])


def cpu_pct(device, rate_hz, seconds):
    """User and system time of each radio relative to the elapsed time."""
    graph = gr.top_block()
    for unit in (1, 2):
        source = soapy.source(f"{device},unit={unit}", "fc32", 1, "", *NO_ARGS)
        sink = soapy.sink(f"{device},unit={unit}", "fc32", 1, "", *NO_ARGS)
        for end in (source, sink):
            end.set_sample_rate(0, rate_hz)
            end.set_frequency(0, 915e6)
        graph.connect(source, blocks.null_sink(gr.sizeof_gr_complex))
        graph.connect(blocks.null_source(gr.sizeof_gr_complex), sink)
    graph.start()
    time.sleep(SETTLE_S)
    began_s, cpu_s = time.monotonic(), time.process_time()
    time.sleep(seconds)
    share = (time.process_time() - cpu_s) / (time.monotonic() - began_s)
    graph.stop()
    graph.wait()
    return 100 * share / 2


def main():
    """Print the figure of each rate in turn."""
    device, seconds = sys.argv[1], float(sys.argv[2])
    print(*(cpu_pct(device, float(each), seconds) for each in sys.argv[3:]))


if __name__ == "__main__":
    main()
