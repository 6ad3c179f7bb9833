"""Cuts messages into each protocol's datagrams, and joins them again. No sockets here.

A `cut_*` function makes the datagrams of one message. A `*Join` takes one datagram (or, for TCP,
one piece of the stream) at a time, and yields the messages that it completes.
"""

import struct
from collections.abc import Iterator

HEAD = struct.Struct("<II")
"""The start of each message of an experiment: its flow's number, its own number."""

LENGTH = struct.Struct("<I")

UDPROS = struct.Struct("<IBBH")
"""Connection, operation, message, block: first the number of blocks, then the block's own."""
UDPROS_DATAGRAM = 1500
"""Bytes of UDP payload: roscpp's own limit.

It leaves no room for the IP and UDP headers, so each full datagram becomes two IP packets.
"""
DATA0, DATAN = 0, 1

NIMBRO = struct.Struct("<HH")
"""Fragment, message."""
NIMBRO_FIRST = struct.Struct("<HH64s64s16sHH")
"""Fragment, message, topic, type, MD5, fragments that follow, flags."""
NIMBRO_DATAGRAM = 1500 - 20 - 8
NIMBRO_TCP = struct.Struct("<HHI16sI")
"""Bytes of topic, of type, of data; MD5, flags."""
TYPE = b"std_msgs/UInt8MultiArray"

POUND = struct.Struct("<IIIIIIBBBxII")
"""Part, its size, the message's size and number, deadline, time stamp, priority, port, source,
destination, number of parts."""
POUND_PART = 1400

UNDER_WAY = 32
"""Number of incomplete messages that a join keeps; the oldest is dropped first."""


class TcpRosJoin:
    """Joins TCPROS messages: 4 bytes of length before each."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def feed(self, piece: bytes) -> Iterator[bytes]:
        """The messages that end within this piece of the stream."""
        self._bytes += piece
        while len(self._bytes) >= LENGTH.size:
            end = LENGTH.size + LENGTH.unpack_from(self._bytes)[0]
            if len(self._bytes) < end:
                return
            message = bytes(self._bytes[LENGTH.size : end])
            del self._bytes[:end]
            yield message


def cut_tcpros(message: bytes) -> bytes:
    """A message as it is written to the stream."""
    return LENGTH.pack(len(message)) + message


def cut_nimbro_tcp(message: bytes, topic: bytes) -> bytes:
    """nimbro_network's message for TCP; the receiver answers each with one byte."""
    head = NIMBRO_TCP.pack(len(topic), len(TYPE), len(message), bytes(16), 0)
    return head + topic + TYPE + message


class NimbroTcpJoin:
    """The other end of `cut_nimbro_tcp`."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def feed(self, piece: bytes) -> Iterator[bytes]:
        """The messages that end within this piece of the stream."""
        self._bytes += piece
        while len(self._bytes) >= NIMBRO_TCP.size:
            topic, kind, size, _, _ = NIMBRO_TCP.unpack_from(self._bytes)
            begin = NIMBRO_TCP.size + topic + kind
            if len(self._bytes) < begin + size:
                return
            message = bytes(self._bytes[begin : begin + size])
            del self._bytes[: begin + size]
            yield message


def cut_udpros(message: bytes, connection: int, number: int) -> list[bytes]:
    """UDPROS: 8 bytes of header before each block; `number` is the message's, of 8 bits."""
    room = UDPROS_DATAGRAM - UDPROS.size
    blocks = [message[at : at + room] for at in range(0, len(message), room)]
    first = UDPROS.pack(connection, DATA0, number, len(blocks)) + blocks[0]
    return [first] + [
        UDPROS.pack(connection, DATAN, number, i) + block for i, block in enumerate(blocks[1:], 1)
    ]


class UdpRosJoin:
    """Joins blocks as roscpp does: in order only; a missing one costs the message."""

    def __init__(self) -> None:
        self._number = -1
        self._total = 0
        self._blocks: list[bytes] = []

    def feed(self, datagram: bytes) -> Iterator[bytes]:
        """The message that this datagram completes, if any."""
        _, operation, number, block = UDPROS.unpack_from(datagram)
        if operation == DATA0:
            self._number, self._total, self._blocks = number, block, []
        elif number != self._number or block != len(self._blocks):
            self._number = -1
            return
        self._blocks.append(datagram[UDPROS.size :])
        if len(self._blocks) == self._total:
            self._number = -1
            yield b"".join(self._blocks)


def cut_nimbro(message: bytes, number: int, topic: bytes) -> list[bytes]:
    """nimbro_network's datagrams: the first names the topic; `number` is the message's, 16 bits."""
    first, room = NIMBRO_DATAGRAM - NIMBRO_FIRST.size, NIMBRO_DATAGRAM - NIMBRO.size
    rest = [message[at : at + room] for at in range(first, len(message), room)]
    head = NIMBRO_FIRST.pack(0, number, topic, TYPE, bytes(16), len(rest), 0)
    return [head + message[:first]] + [
        NIMBRO.pack(i, number) + part for i, part in enumerate(rest, 1)
    ]


class NimbroJoin:
    """Joins nimbro_network's fragments, which come in any order."""

    def __init__(self) -> None:
        self.under_way: dict[int, dict[int, bytes]] = {}
        self._totals: dict[int, int] = {}

    def feed(self, datagram: bytes) -> Iterator[bytes]:
        """The message that this datagram completes, if any."""
        part, number = NIMBRO.unpack_from(datagram)
        parts = _under_way(self.under_way, number)
        if part == 0:
            self._totals[number] = 1 + NIMBRO_FIRST.unpack_from(datagram)[5]
        parts[part] = datagram[NIMBRO.size if part else NIMBRO_FIRST.size :]
        if len(parts) == self._totals.get(number):
            del self.under_way[number], self._totals[number]
            yield b"".join(parts[i] for i in range(len(parts)))


def cut_pound(message: bytes, number: int, priority: int, port: int) -> list[bytes]:
    """Pound's datagrams, of up to 1400 bytes of the message each."""
    parts = [message[at : at + POUND_PART] for at in range(0, len(message), POUND_PART)]
    size, total = len(message), len(parts)
    return [
        POUND.pack(i, len(part), size, number, 0, 0, priority, port, 0, 1, total) + part
        for i, part in enumerate(parts)
    ]


class PoundJoin:
    """Joins Pound's fragments, which come in any order."""

    def __init__(self) -> None:
        self.under_way: dict[int, dict[int, bytes]] = {}

    def feed(self, datagram: bytes) -> Iterator[bytes]:
        """The message that this datagram completes, if any."""
        part, _, _, number, *_, total = POUND.unpack_from(datagram)
        parts = _under_way(self.under_way, number)
        parts[part] = datagram[POUND.size :]
        if len(parts) == total:
            del self.under_way[number]
            yield b"".join(parts[i] for i in range(total))


def _under_way(messages: dict[int, dict[int, bytes]], number: int) -> dict[int, bytes]:
    if number not in messages:
        if len(messages) >= UNDER_WAY:
            del messages[next(iter(messages))]
        messages[number] = {}
    return messages[number]
