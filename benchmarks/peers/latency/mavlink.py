"""MAVLink 2 by pymavlink. Runs in its own environment.

The paper changed messages so that each had 115 bytes. Here, likewise, each topic is a message of
its own with exactly the size of its payload, by a class like those that MAVLink's generator makes,
plus 12 bytes of MAVLink framing. (TUNNEL, of the common dialect, would add 5 bytes, and ends at
128.)

Incoming messages are parsed by pymavlink, checked, and unpacked field by field into an object, as
MAVROS and PX4 do; the object's field then becomes the payload again.
"""

import importlib
import struct
from collections.abc import Iterator
from typing import Any

from benchmarks.peers.latency.job import ANSWERED, ASKED, FIRST_TOPIC, MOST_TOPICS, REPLY, REQUEST

COMPONENTS = {"fcu": 1, "companion": 191}
"""MAV_COMP_ID_AUTOPILOT1, MAV_COMP_ID_ONBOARD_COMPUTER."""
SYSTEM = 1
FIRST_ID = 52000
"""First message id of ours; the common dialect has none this high."""
CRC_EXTRA = 115
"""Stands for a checksum of the message's definition."""


class Mavlink:
    """One end's encoder and parser."""

    def __init__(self, side: str, size: int) -> None:
        # Imported here: it is not installed in the type checker's environment.
        self._common: Any = importlib.import_module("pymavlink.dialects.v20.common")
        self._mavlink = self._common.MAVLink(None, SYSTEM, COMPONENTS[side])
        self._mavlink.robust_parsing = True
        self._topics = {
            kind: message_class(self._common, kind, size)
            for kind in range(FIRST_TOPIC, FIRST_TOPIC + MOST_TOPICS)
        }
        self._common.mavlink_map.update({made.id: made for made in self._topics.values()})

    def encode(self, kind: int, payload: bytes) -> bytes:
        """Encode a message. A reply holds only one of the responder's stamps: when it was sent."""
        if kind == REQUEST:
            message = self._common.MAVLink_timesync_message(0, *ASKED.unpack(payload))
        elif kind == REPLY:
            asked, _, sent = ANSWERED.unpack(payload)
            message = self._common.MAVLink_timesync_message(sent, asked)
        else:
            message = self._topics[kind](payload)
        frame: bytes = message.pack(self._mavlink)
        self._mavlink.seq = (self._mavlink.seq + 1) % 256
        return frame

    def decode(self, chunk: bytes) -> Iterator[tuple[int, bytes]]:
        """Decode messages of both kinds; others, and bytes outside messages, are skipped."""
        message = self._mavlink.parse_char(chunk)
        while message is not None:
            if message.get_type() == "TIMESYNC":
                yield _timesync(message)
            elif message.get_type() == "TOPIC":
                yield message.get_msgId() - FIRST_ID, bytes(message.data)
            message = self._mavlink.parse_char(b"")


def _timesync(message: Any) -> tuple[int, bytes]:  # noqa: ANN401
    if message.tc1 == 0:
        return REQUEST, ASKED.pack(message.ts1)
    return REPLY, ANSWERED.pack(message.ts1, message.tc1, message.tc1)


def message_class(common: Any, kind: int, size: int) -> Any:  # noqa: ANN401
    """A topic's message class, as the generator would make it: `uint8_t[size] data`."""

    def init(self: Any, data: bytes) -> None:  # noqa: ANN401
        common.MAVLink_message.__init__(self, self.id, self.msgname)
        self._fieldnames = self.fieldnames
        self.data = data

    def pack(self: Any, mavlink: Any, force_mavlink1: bool = False) -> bytes:  # noqa: ANN401
        payload = self.unpacker.pack(*self.data)
        packed: bytes = self._pack(mavlink, self.crc_extra, payload, force_mavlink1)
        return packed

    fields = {
        "id": FIRST_ID + kind,
        "msgname": "TOPIC",
        "fieldnames": ["data"],
        "ordered_fieldnames": ["data"],
        "fieldtypes": ["uint8_t"],
        "orders": [0],
        "lengths": [size],
        "array_lengths": [size],
        "crc_extra": CRC_EXTRA,
        "unpacker": struct.Struct(f"<{size}B"),
        "__init__": init,
        "pack": pack,
    }
    return type("Topic", (common.MAVLink_message,), fields)
