"""A client of Foxglove's WebSocket protocol, written from its specification, without the SDK."""

import base64
import contextlib
import json
import struct
import time
from fnmatch import fnmatchcase

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from websockets.sync.client import connect

SUBPROTOCOL = "foxglove.sdk.v1"
MESSAGE_DATA = 1
TOO_SOON = "Unknown channel ID: "
"""The SDK advertises a channel a moment before it knows it."""


class Viewer:
    """Sees what a server advertises, and the messages of the topics that match `wanted`."""

    def __init__(self, url, *wanted):
        self._wanted = wanted
        self._open = contextlib.ExitStack()
        options = {"subprotocols": [SUBPROTOCOL], "max_size": None, "compression": None}
        self._socket = self._open.enter_context(connect(url, **options))
        self.info = {}
        self.channels = {}
        self.statuses = []
        self.messages = {}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._open.close()

    def advertise(self, number, topic, kind="geometry_msgs/msg/Twist", encoding="cdr"):
        """Say that messages of a topic are going to be published."""
        channel = {"id": number, "topic": topic, "encoding": encoding, "schemaName": kind}
        self._tell({"op": "advertise", "channels": [channel]})

    def publish(self, number, data):
        """Publish a message on a channel that was advertised under a number."""
        self._socket.send(struct.pack("<BI", MESSAGE_DATA, number) + data)

    def until(self, condition, timeout_s=20):
        """Receive until `condition()` holds; returns it."""
        deadline = time.monotonic() + timeout_s
        while not (found := condition()):
            assert time.monotonic() < deadline, ("waited in vain", self.statuses, self.channels)
            with contextlib.suppress(TimeoutError):
                self._take(self._socket.recv(0.1))
        return found

    def payloads(self, topic):
        """The payloads that have come of a topic."""
        return [payload for _, payload in self.messages.get(topic, ())]

    def decoded(self, topic):
        """The messages that have come of a topic, as maps or protobuf messages by its schema."""
        if topic not in self.channels:
            return []
        channel = self.channels[topic]
        read = json.loads if channel["encoding"] == "json" else _protobuf(channel).FromString
        return [read(payload) for payload in self.payloads(topic)]

    def _take(self, frame):
        if isinstance(frame, bytes):
            kind, subscription, time_ns = struct.unpack_from("<BIQ", frame)
            assert kind == MESSAGE_DATA
            (topic,) = [name for name, each in self.channels.items() if each["id"] == subscription]
            self.messages.setdefault(topic, []).append((time_ns, frame[13:]))
            return
        told = json.loads(frame)
        if told["op"] == "serverInfo":
            self.info = told
        elif told["op"] == "status" and told["message"].startswith(TOO_SOON):
            self._subscribe(int(told["message"].removeprefix(TOO_SOON)))
        elif told["op"] == "status":
            self.statuses.append(told)
        elif told["op"] == "advertise":
            for each in told["channels"]:
                self.channels[each["topic"]] = each
                if any(fnmatchcase(each["topic"], one) for one in self._wanted):
                    self._subscribe(each["id"])

    def _subscribe(self, channel):
        asked = {"id": channel, "channelId": channel}
        self._tell({"op": "subscribe", "subscriptions": [asked]})

    def _tell(self, what):
        self._socket.send(json.dumps(what))


def _protobuf(channel):
    """The class of a channel's messages, made from the schema that it advertises."""
    files = descriptor_pb2.FileDescriptorSet.FromString(base64.b64decode(channel["schema"]))
    pool = descriptor_pool.DescriptorPool()
    for each in files.file:
        pool.Add(each)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(channel["schemaName"]))
