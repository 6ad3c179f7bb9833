"""A transport over a serial device, with a codec between messages and bytes."""

import os
import select
from collections.abc import Iterator
from typing import Protocol

CHUNK = 4096


class Codec(Protocol):
    """A protocol for serial lines, without the line."""

    def encode(self, kind: int, payload: bytes) -> bytes:
        """A message as bytes for the line."""

    def decode(self, chunk: bytes) -> Iterator[tuple[int, bytes]]:
        """Kind and payload of messages that end within this chunk of the stream."""


class SerialPort:
    """One end of a serial line."""

    def __init__(self, device: str, codec: Codec) -> None:
        self._device = os.open(device, os.O_RDWR | os.O_NOCTTY)
        self._codec = codec

    def fileno(self) -> int:
        """Descriptor that is readable when there is something to receive."""
        return self._device

    def send(self, kind: int, payload: bytes) -> None:
        """Write a message to the line at once."""
        os.write(self._device, self._codec.encode(kind, payload))

    def receive(self, timeout_s: float) -> Iterator[tuple[int, bytes]]:
        """Wait for one chunk, and yield the messages that end in it."""
        if select.select([self._device], [], [], timeout_s)[0]:
            yield from self._codec.decode(os.read(self._device, CHUNK))
