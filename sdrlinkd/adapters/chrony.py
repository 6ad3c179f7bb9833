"""Feeds another robot's clock to chronyd's SOCK reference clock; it sets no clock itself."""

import socket
import struct
from pathlib import Path

SAMPLE = struct.Struct("@qqdiiii")
"""struct sock_sample of chrony's refclock_sock.c: tv_sec, tv_usec, offset in s (true less system
time), pulse, leap, padding, magic."""
MAGIC = 0x534F434B
LEAP_NORMAL = 0


class ChronySocket:
    """Sends samples to chronyd's `refclock SOCK PATH`; samples are lost while chronyd is away."""

    def __init__(self, path: Path) -> None:
        self._path = str(path)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self.sent = self.lost = 0

    def send(self, now_ns: int, offset_s: float) -> None:
        """Send a sample: the true time is the system time `now_ns` (since 1970) plus `offset_s`."""
        seconds, rest_ns = divmod(now_ns, 1_000_000_000)
        sample = SAMPLE.pack(seconds, rest_ns // 1000, offset_s, 0, LEAP_NORMAL, 0, MAGIC)
        try:
            self._socket.sendto(sample, self._path)
            self.sent += 1
        except OSError:
            self.lost += 1

    def close(self) -> None:
        """Close our socket; chronyd's stays."""
        self._socket.close()
