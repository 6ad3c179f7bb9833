"""The serial line: by calculation, and through the pseudo-terminals."""

import contextlib
import json
import os
import socket
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.peers.latency.pacer import BUFFER, PIECE, Pacer
from benchmarks.peers.latency.table import BAUD
from benchmarks.processes import start_module

BYTE_S = 10 / BAUD
chunks = st.lists(st.tuples(st.floats(0, 0.01), st.binary(min_size=1, max_size=400)), max_size=30)


def drained(pacer):
    """(when, bytes) of everything it holds."""
    out = []
    while pacer.due < float("inf"):
        out.append((pacer.due, pacer.give(pacer.due)))
    return out


@given(chunks)
def test_a_chunk_is_out_after_its_time_on_the_line(written):
    pacer, now, free = Pacer(BAUD), 0.0, 0.0
    for gap, chunk in written:
        now += gap
        pacer.give(now)
        before = pacer.dropped
        pacer.take(chunk, now)
        if pacer.dropped == before:
            free = max(now, free) + len(chunk) * BYTE_S
    out = drained(pacer)
    assert not out or out[-1][0] == pytest.approx(free)


@given(chunks)
def test_what_is_not_dropped_comes_out_in_order(written):
    pacer, now, kept, out = Pacer(BAUD), 0.0, b"", b""
    for gap, chunk in written:
        now += gap
        out += pacer.give(now)
        before = pacer.dropped
        pacer.take(chunk, now)
        kept += chunk if pacer.dropped == before else b""
    assert out + b"".join(piece for _, piece in drained(pacer)) == kept


def test_a_long_chunk_comes_piece_by_piece():
    pacer = Pacer(BAUD)
    pacer.take(bytes(3 * PIECE + 1), 1.0)
    whole = [1.0 + n * PIECE * BYTE_S for n in (1, 2, 3)]
    out = drained(pacer)
    assert [at for at, _ in out] == pytest.approx([*whole, whole[-1] + BYTE_S])
    assert [len(piece) for _, piece in out] == [PIECE] * 3 + [1]


def test_a_busy_line_drops_what_its_buffer_cannot_hold():
    pacer = Pacer(BAUD)
    pacer.take(bytes(BUFFER), 0.0)
    pacer.take(b"more", 0.0)
    assert pacer.dropped == 4
    pacer.give(PIECE * BYTE_S)
    pacer.take(b"more", PIECE * BYTE_S)
    assert pacer.dropped == 4


def opened(place):
    """A device by its path, or the port of a serial server."""
    if place.isdigit():
        return socket.create_connection(("127.0.0.1", int(place))).detach()
    return os.open(place, os.O_RDWR | os.O_NOCTTY)


@pytest.mark.parametrize("kind", [(), ("tcp",)])
def test_the_line_carries_any_bytes_both_ways_no_faster_than_its_rate(kind):
    data = bytes(range(256)) * 4
    with contextlib.ExitStack() as stack:
        line = start_module(stack, "line", "benchmarks.peers.latency.wire", str(BAUD), *kind)
        devices = [opened(place) for place in json.loads(line.line())]
        for source, sink in (devices, devices[::-1]):
            begin, got = time.monotonic(), b""
            os.write(source, data)
            while len(got) < len(data):
                got += os.read(sink, 4096)
            assert got == data
            assert time.monotonic() - begin >= len(data) * BYTE_S
        line.close_input()
        late = json.loads(line.line())
        for device in devices:
            os.close(device)
    assert min(late) >= 0
