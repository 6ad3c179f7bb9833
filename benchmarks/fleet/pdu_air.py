"""An air of PDUs for real daemons: who hears whom, and how much of it."""

import selectors
import socket
import threading
from collections.abc import Collection
from random import Random
from typing import Self

MOST_OCTETS = 4096


class PduAir:
    """Carries PDUs between daemons with `backend = "gnuradio"` and `transport = "udp"`.

    `loss[src, dst]` is the share of PDUs from `src` that `dst` does not hear, 0 by default.
    """

    def __init__(self, robots: Collection[int], seed: int = 1) -> None:
        self.loss: dict[tuple[int, int], float] = {}
        self._rng = Random(seed)
        self._sockets: dict[int, socket.socket] = {}
        self._daemons: dict[int, tuple[str, int]] = {}
        """Address of each robot's daemon, from its first PDU on."""
        self._selector = selectors.DefaultSelector()
        for robot in robots:
            bound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            bound.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
            bound.bind(("127.0.0.1", 0))
            self._sockets[robot] = bound
            self._selector.register(bound, selectors.EVENT_READ, robot)
        self._wake, self._woken = socket.socketpair()
        self._selector.register(self._woken, selectors.EVENT_READ, None)
        self._thread = threading.Thread(target=self._run, name="air")
        self._thread.start()

    def settings(self, robot: int) -> str:
        """The TOML of a robot's daemon for this air."""
        port = self._sockets[robot].getsockname()[1]
        return (
            f'[gnuradio]\ntransport = "udp"\nsend = "127.0.0.1:{port}"\nrate_bit_s = 2e6\n'
            "[link]\nbeacon_s = 0.2\n"
        )

    def forge(self, dst: int, pdu: bytes) -> None:
        """Have robot `dst`, which has sent before, hear a PDU that no robot sent."""
        self._sockets[dst].sendto(pdu, self._daemons[dst])

    def close(self) -> None:
        """Carry nothing any more."""
        self._wake.send(b".")
        self._thread.join()
        for each in (*self._sockets.values(), self._wake, self._woken):
            each.close()
        self._selector.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self) -> None:
        while True:
            for found, _ in self._selector.select():
                if found.data is None:
                    return
                pdu, self._daemons[found.data] = self._sockets[found.data].recvfrom(MOST_OCTETS)
                self._carry(found.data, pdu)

    def _carry(self, src: int, pdu: bytes) -> None:
        for dst, address in self._daemons.items():
            if dst != src and self._rng.random() >= self.loss.get((src, dst), 0.0):
                self._sockets[dst].sendto(pdu, address)
