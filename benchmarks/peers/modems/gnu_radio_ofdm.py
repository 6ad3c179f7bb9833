"""GNU Radio's own OFDM modem, run by GNU Radio's interpreter.

    python3 gnu_radio_ofdm.py errors BITS BYTES SNR_DB FRAMES SEED   frames lost
    python3 gnu_radio_ofdm.py speed BITS BYTES FRAMES SEED           Msps of CPU time: tx, rx
    python3 gnu_radio_ofdm.py noise SAMPLES SEED                     Msps of CPU time on noise

`digital.ofdm_tx` and `ofdm_rx` with 64 subcarriers, prefix 16, no code. SNR is a frame's mean power
over that of the noise in the sample band. 200 to 599 samples of noise precede each frame, and its
frequency offset is up to 0.02 radians per sample. CPU time is that of all threads of the flowgraph.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from gnuradio import blocks, digital, gr

TAG = "packet_length"
GAP = 400


def payloads(rng, n_frames, n_bytes):
    """Random payloads, each starting with its number."""
    frames = rng.integers(0, 256, (n_frames, n_bytes), np.uint8)
    frames[:, :4] = np.arange(n_frames, dtype=">u4").view(np.uint8).reshape(-1, 4)
    return frames


def run(*chain):
    """CPU time of a flowgraph of these blocks."""
    graph = gr.top_block()
    graph.connect(*chain)
    begin = time.process_time()
    graph.run()
    return time.process_time() - begin


def send(frames, bits):
    """Modulate frames; (samples `[n_frames, n]`, CPU time)."""
    source = blocks.vector_source_b(frames.reshape(-1).tolist(), False)
    tagged = blocks.stream_to_tagged_stream(gr.sizeof_char, 1, frames.shape[1], TAG)
    modem = digital.ofdm_tx(packet_length_tag_key=TAG, bps_header=1, bps_payload=bits)
    sink = blocks.vector_sink_c()
    took_s = run(source, tagged, modem, sink)
    return np.array(sink.data(), np.complex64).reshape(len(frames), -1), took_s


def hear(samples, bits):
    """Demodulate samples; (bytes of all received frames, CPU time)."""
    # Via a file: the receiver would take the sender's tags for its own.
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "samples.cf32"
        samples.tofile(path)
        source = blocks.file_source(gr.sizeof_gr_complex, str(path), False)
        modem = digital.ofdm_rx(packet_length_tag_key=TAG, bps_header=1, bps_payload=bits)
        sink = blocks.vector_sink_b()
        took_s = run(source, modem, sink)
    return bytes(sink.data()), took_s


def through(rng, bursts, snr_db, gaps):
    """All bursts in one stream, with noise."""
    power, parts = np.mean(np.abs(bursts) ** 2), []
    for burst, gap in zip(bursts, gaps, strict=True):
        angle = rng.uniform(-0.02, 0.02) * np.arange(len(burst)) + rng.uniform(0, 2 * np.pi)
        parts += [np.zeros(gap, np.complex64), burst * np.exp(1j * angle)]
    stream = np.concatenate([*parts, np.zeros(4000)])
    noise = rng.standard_normal((len(stream), 2)) @ [1, 1j]
    stream = stream + noise * np.sqrt(power * 10 ** (-snr_db / 10) / 2)
    return stream.astype(np.complex64)


def count(told, frames):
    """Number of frames that are among the received bytes."""
    n = frames.shape[1]
    got = {told[at : at + n] for at in range(0, len(told) - n + 1, n)}
    return sum(frame.tobytes() in got for frame in frames)


def main(what, *numbers):
    gr.logging().set_default_level(gr.log_levels.off)
    values = [float(number) for number in numbers]
    rng = np.random.default_rng(int(values[-1]))
    if what == "noise":
        noise = (rng.standard_normal((int(values[0]), 2)) @ [1, 1j]).astype(np.complex64)
        print(len(noise) / min(hear(noise, 1)[1] for _ in range(2)) * 1e-6)
        return
    bits, n_bytes = int(values[0]), int(values[1])
    n = int(values[3] if what == "errors" else values[2])
    frames = payloads(rng, n, n_bytes)
    bursts, _ = send(frames, bits)
    if what == "errors":
        stream = through(rng, bursts, values[2], rng.integers(200, 600, n))
        print(n - count(hear(stream, bits)[0], frames))
        return
    send_s = min(send(frames, bits)[1] for _ in range(3))
    stream = through(rng, bursts, 30.0, [GAP] * n)
    hear_s = min(hear(stream, bits)[1] for _ in range(3))
    print(bursts.size / send_s * 1e-6, len(stream) / hear_s * 1e-6)


if __name__ == "__main__":
    main(*sys.argv[1:])
