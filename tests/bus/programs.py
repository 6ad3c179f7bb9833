"""A daemon's bus in this process, with a link that takes notes, and programs beside it."""

import asyncio
from pathlib import Path

import msgspec
import zmq
import zmq.asyncio

from sdrlinkd.bus import Bus, RuntimeDirectory
from sdrlinkd.client import ACK_PREFIX, SYNC_PREFIX, endpoint
from sdrlinkd.config import make_setup, parse_config
from sdrlinkd.link import AS_CONFIGURED

REGISTRY = Path(__file__).parents[2] / "etc" / "registry.csv"
EMPTY = b"\x01\x80"


class Ingress:
    """Notes what the bus passes on to the link, and what it refuses."""

    def __init__(self):
        self.taken = []
        self.refused = []

    def submit(self, topic_id, payload, overrides=AS_CONFIGURED, published_ns=None):
        self.taken.append((topic_id, payload, overrides, published_ns))

    def refuse(self, reason, topic_id=None, receipt="", dst=None):
        self.refused.append((reason, topic_id, receipt, dst))


class Program:
    """A program with a socket to send on, and one that hears what it subscribes to."""

    def __init__(self, context, folder, into):
        self.out = context.socket(into)
        self.out.connect(endpoint(folder, "in.sock" if into == zmq.PUSH else "in-pub.sock"))
        self.heard = context.socket(zmq.SUB)
        self.heard.connect(endpoint(folder, "out.sock"))
        self._tokens = 0
        self._came = []

    async def send(self, topic, payload, header=None):
        """Send a message, which the daemon has taken when this returns."""
        told = EMPTY if header is None else b"\x01" + msgspec.msgpack.encode(header)
        await self.send_frames(topic.encode() + b"\0", told, payload)

    async def send_frames(self, *frames):
        await self.out.send_multipart(frames)
        await self.until_taken()

    async def subscribe(self, *topics):
        """Subscribe; whatever is published from now on is heard. Returns the welcome's map."""
        for topic in topics:
            self.heard.subscribe(topic)
        ack = self._ack()
        self.heard.subscribe(ack)
        return self.read(await self._next(ack))

    async def unsubscribe(self, topic):
        self.heard.unsubscribe(topic)
        await self.subscribe()

    async def until_taken(self):
        """Wait until the daemon has taken all that was sent."""
        ack = self._ack()
        self.heard.subscribe(ack)
        await self._next(ack)
        await self.out.send_multipart([SYNC_PREFIX + ack.removeprefix(ACK_PREFIX), EMPTY, b""])
        await self._next(ack)

    async def take(self):
        """The frames of the next message that is heard."""
        async with asyncio.timeout(30):
            return await self.heard.recv_multipart()

    async def all(self):
        """All that has come since the last call."""
        await self.subscribe()
        came, self._came = self._came, []
        return came

    async def _next(self, topic):
        while (frames := await self.take())[0] != topic:
            self._came.append(frames)
        return frames

    def _ack(self):
        self._tokens += 1
        return ACK_PREFIX + b"%d-%d\0" % (id(self), self._tokens)

    @staticmethod
    def read(frames):
        """The map in the second frame."""
        assert frames[1][:1] == b"\x01"
        return msgspec.msgpack.decode(frames[1][1:])


class Beside:
    """The bus, the link's notes, and programs."""

    def __init__(self, folder, more=""):
        text = f'robot_id = 1\nregistry = "{REGISTRY}"\n{more}'
        self.setup = make_setup(parse_config(text, "test"), folder)
        self.ingress = Ingress()
        self.context = zmq.Context()
        self.programs = zmq.asyncio.Context()
        self._programs = []
        self.directory = RuntimeDirectory(folder)
        self.folder = folder
        self.bus = Bus(self.context, self.directory, self.setup, self.ingress)

    def program(self, into=zmq.PUSH):
        self._programs.append(Program(self.programs, self.folder, into))
        return self._programs[-1]

    def close(self):
        self.bus.close()
        for program in self._programs:
            program.out.close(linger=0)
            program.heard.close(linger=0)
        self.programs.term()
        self.context.destroy(linger=0)
        self.directory.close()
