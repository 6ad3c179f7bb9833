"""Samples as chronyd's SOCK reference clock reads them."""

import socket
import struct

import pytest

from sdrlinkd.adapters import ChronySocket


def test_a_sample_is_chronys_struct(tmp_path):
    path = tmp_path / "chrony.sock"
    chrony = ChronySocket(path)
    chrony.send(0, 0.0)
    assert (chrony.sent, chrony.lost) == (0, 1), "nobody listens yet"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as there:
        there.bind(str(path))
        there.settimeout(5)
        chrony.send(1_800_000_000_123_456_789, -0.25)
        data = there.recv(100)
    chrony.close()
    assert len(data) == 40
    seconds, micros, offset_s, pulse, leap, _, magic = struct.unpack("@qqdiiii", data)
    assert (seconds, micros, pulse, leap) == (1_800_000_000, 123_456, 0, 0)
    assert offset_s == pytest.approx(-0.25)
    assert magic.to_bytes(4, "big") == b"SOCK"
