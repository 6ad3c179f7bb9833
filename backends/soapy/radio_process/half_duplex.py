"""Drives a device that cannot receive while it sends; one thread does both."""

import time

from backends.soapy.radio_process.rx_stream import RxStream
from backends.soapy.radio_process.sample_counted_tx import SampleCountedTransmitter
from backends.soapy.radio_process.tx_commands import TxCommands

READ_US = 5_000
"""Maximum time that commands wait for a read."""


class HalfDuplex:
    """Receives, and sends in TX windows in between. Only one thread may call the driver."""

    def __init__(
        self,
        rx_stream: RxStream,
        transmitter: SampleCountedTransmitter,
        commands: TxCommands,
        listen_s: float,
    ) -> None:
        self._rx_stream = rx_stream
        self._transmitter = transmitter
        self._commands = commands
        self._listen_ns = round(1e9 * listen_s)
        self._listens_until_ns = 0

    def step(self) -> None:
        """Receive a piece, then send if a burst is due."""
        self._rx_stream.step(READ_US)
        self._commands.wait(0)
        if self._transmitter.is_due() and time.monotonic_ns() >= self._listens_until_ns:
            self._rx_stream.pause()
            self._transmitter.send_window()
            self._rx_stream.resume()
            self._listens_until_ns = time.monotonic_ns() + self._listen_ns
