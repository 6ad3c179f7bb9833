"""In the radio process: a device that cannot receive while it sends; one thread does both."""

import time

from backends.soapy.counted import CountedSender
from backends.soapy.orders import Orders
from backends.soapy.receiving import Receiving

READ_US = 5_000
"""Orders wait for at most so long."""


class HalfDuplex:
    """Receives, and between that sends in spells. The driver must never see two threads."""

    def __init__(
        self, receiving: Receiving, sender: CountedSender, orders: Orders, listen_s: float
    ) -> None:
        self._receiving = receiving
        self._sender = sender
        self._orders = orders
        self._listen_ns = round(1e9 * listen_s)
        self._listens_until_ns = 0

    def step(self) -> None:
        """Receive a piece; send when it is time."""
        self._receiving.step(READ_US)
        self._orders.wait(0)
        if self._sender.is_due() and time.monotonic_ns() >= self._listens_until_ns:
            self._receiving.pause()
            self._sender.send_spell()
            self._receiving.resume()
            self._listens_until_ns = time.monotonic_ns() + self._listen_ns
