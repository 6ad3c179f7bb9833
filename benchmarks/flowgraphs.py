"""GNU Radio's flowgraphs of etc/gnuradio as a modem: PDUs delivered, latency, PDUs per second.

A flowgraph in real time at 1 Msps and 25 dB gets PDUs as a daemon hands them over. Latency is that
of a single PDU; throughput is measured with eight PDUs in flight.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random
from typing import NamedTuple

import zmq

from benchmarks.absent import PeerError, attempt
from benchmarks.report import Row, main
from sdrlinkd.pdulink import from_gnu_radio, to_gnu_radio
from sdrlinkd.process import Process

PYTHON = "/usr/bin/python3"
FLOWGRAPHS = Path(__file__).parents[1] / "etc" / "gnuradio"
PHYS = {
    "ofdm_bpsk": ("ofdm_phy", "--bits", "1"),
    "ofdm_qpsk": ("ofdm_phy", "--bits", "2"),
    "gfsk": ("gfsk_phy",),
}
SIZES = (64, 220, 1000)
UNDER_WAY = 8
PATIENCE_MS = 3000


class Ends(NamedTuple):
    """The sockets that a daemon would use."""

    out: "zmq.Socket[bytes]"
    back: "zmq.Socket[bytes]"


class Told(NamedTuple):
    """Outcome of the PDUs of one phase."""

    delivered: int
    latencies_ms: list[float]
    seconds: float


@contextmanager
def _running(command: tuple[str, ...], size: int) -> Iterator[Ends]:
    with tempfile.TemporaryDirectory() as folder, zmq.Context() as context:
        send, receive = f"ipc://{folder}/send", f"ipc://{folder}/receive"
        name, *options = command
        words = [
            PYTHON, str(FLOWGRAPHS / f"{name}.py"), *options, "--pdu-size", str(size),
            "--snr-db", "25", "--loop", send, receive,
        ]  # fmt: skip
        with Process(words, name=name, session=False) as flowgraph:
            if (said := flowgraph.line()) != "ready":
                raise PeerError(f"{name} says {said!r}")
            with context.socket(zmq.PUSH) as out, context.socket(zmq.PULL) as back:
                out.setsockopt(zmq.LINGER, 0)
                out.bind(send)
                back.connect(receive)
                yield Ends(out, back)


def _pass(ends: Ends, pdus: list[bytes], under_way: int) -> Told:
    """Send all PDUs, with at most `under_way` in flight."""
    left = dict.fromkeys(pdus, 0.0)
    waiting, latencies, begun = list(reversed(pdus)), [], time.perf_counter()
    flying = 0
    while waiting or flying:
        while waiting and flying < under_way:
            pdu = waiting.pop()
            left[pdu] = time.perf_counter()
            ends.out.send(to_gnu_radio(pdu))
            flying += 1
        if not ends.back.poll(PATIENCE_MS):
            flying = 0
            continue
        pdu = from_gnu_radio(ends.back.recv())
        if sent_at := left.pop(pdu, 0.0):
            latencies.append(1e3 * (time.perf_counter() - sent_at))
            flying -= 1
    return Told(len(latencies), sorted(latencies), time.perf_counter() - begun)


def _rows(name: str, size: int, n: int, rng: Random) -> list[Row]:
    with _running(PHYS[name], size) as ends:
        # The first PDU waits until the flowgraph has really started.
        _pass(ends, [rng.randbytes(size)], 1)
        lone = _pass(ends, [rng.randbytes(size) for _ in range(n // 4)], 1)
        many = _pass(ends, [rng.randbytes(size) for _ in range(n)], UNDER_WAY)
    sent, stem = n // 4 + n, f"{name}_{size}b"
    median_ms = lone.latencies_ms[len(lone.latencies_ms) // 2] if lone.latencies_ms else PATIENCE_MS
    delivered = lone.delivered + many.delivered
    return [
        Row(f"{stem}_pdr", delivered / sent, "", 1.0, "more", sent, note=f"{delivered} of {sent}"),
        Row(f"{stem}_p50_ms", median_ms, "ms", 100.0, "less", lone.delivered),
        Row(f"{stem}_pdus_per_s", many.delivered / many.seconds, "1/s", 10.0, "more", n),
    ]


def measure(seed: int, quick: bool) -> Iterator[Row]:
    """Measure the rows of all modems and sizes."""
    rng = Random(seed)
    n = 20 if quick else 400
    for name in PHYS:
        with attempt(f"{name} (Debian: gnuradio)"):
            for size in SIZES:
                yield from _rows(name, size, n, rng)


if __name__ == "__main__":
    sys.exit(main("flowgraphs", measure, argparse.ArgumentParser(add_help=False)))
