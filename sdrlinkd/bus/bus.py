"""The local bus: messages in from producers, messages out to consumers."""

import asyncio
import secrets
import time
from collections.abc import Iterable, Mapping

import msgspec
import zmq

from sdrlinkd.bus import envelope
from sdrlinkd.bus.announcement import announcement
from sdrlinkd.bus.handed import header_of
from sdrlinkd.bus.intake import Ingress, Intake
from sdrlinkd.bus.retained import Retained, Retention
from sdrlinkd.bus.sockets import RuntimeDirectory
from sdrlinkd.bus.undropped import Undropped
from sdrlinkd.client import (
    ACK_PREFIX,
    IN_PUB_SOCKET,
    IN_SOCKET,
    LATE_PREFIX,
    OUT_SOCKET,
    RECEIPT_PREFIX,
    SYNC_PREFIX,
)
from sdrlinkd.config import Setup
from sdrlinkd.link import (
    DEFAULT_POLICY,
    NOT_RETAINED,
    Delivered,
    HeardTopic,
    Retain,
    TopicPolicy,
    Verdict,
)
from sdrlinkd.localtime import UNKNOWN, LocalTimes
from sdrlinkd.reading import SocketReader
from sdrlinkd.reports import BusReport
from sdrlinkd.wire import Topic

# The daemon reads incoming messages at once rather than let ZeroMQ queue them, so that it counts
# every drop under a reason. Not smaller: when a producer with a full pipe leaves, libzmq drops the
# rest.
IN_HWM = 1000
LINGER_MS = 200
# On shutdown, wait until no message has arrived for QUIET_S; the deadline bounds the wait for a
# producer that never stops.
QUIET_S = 0.01
QUIET_ROUNDS = 3
LAST_MESSAGES_S = 0.3
ENVELOPE_ROOM = 4096
"""Octets of a bus message's frames, besides the payload, from which a program is cut off."""
PDU_TAP = b"\0pdu\0"
SENT_TAP = b"\0sent\0"
AIR_TAP = b"\0air\0"


class Bus:
    """The sockets `in`, `in-pub` and `out` of one daemon."""

    def __init__(
        self,
        context: zmq.Context[zmq.Socket[bytes]],
        directory: RuntimeDirectory,
        setup: Setup,
        ingress: Ingress,
    ) -> None:
        self._context = context
        self._directory = directory
        self._setup = setup
        self._intake = Intake(setup, ingress, self._tell)
        self._retention = Retention()
        self._frames_out: dict[tuple[int, int], bytes] = {}
        self._received = 0
        self._published = 0
        self._taps = 0
        self.is_air_watched = False
        """Whether a client watches what is on the air."""
        self._copied: tuple[bytes, ...] = ()
        """Subscriptions to copies of what this robot's producers send, SENT_TAP and beginnings of
        topic frames."""
        self.filters: frozenset[bytes] = frozenset()
        """Subscriptions to messages from the air, each the beginning of a topic frame."""
        self.has_consumer = asyncio.Event()
        """Set once a consumer has subscribed to messages from the air."""
        self.boot = secrets.token_hex(4)
        """Differs after each start of the daemon."""
        self._welcome = self._announcement(setup.policies)
        loop = asyncio.get_running_loop()
        self._sockets: dict[str, zmq.Socket[bytes]] = {}
        largest = setup.config.bus.max_message_bytes + ENVELOPE_ROOM
        limits: dict[int, int | bytes] = {zmq.RCVHWM: IN_HWM, zmq.MAXMSGSIZE: largest}
        self._pull = self._bind(zmq.PULL, IN_SOCKET, limits)
        self._sub = self._bind(zmq.SUB, IN_PUB_SOCKET, {**limits, zmq.SUBSCRIBE: b""})
        out_options: dict[int, int | bytes] = {
            zmq.SNDHWM: setup.config.rx_depth,
            zmq.XPUB_WELCOME_MSG: b"\0" + self._welcome,
            zmq.MAXMSGSIZE: ENVELOPE_ROOM,
        }
        self._out = self._bind(zmq.XPUB, OUT_SOCKET, out_options)
        self._ingress_readers = [
            SocketReader(loop, each, each.recv_multipart, self._take)
            for each in (self._pull, self._sub)
        ]
        self._out_reader = SocketReader(
            loop, self._out, self._out.recv_multipart, self._take_subscription
        )
        self._undropped = Undropped(loop, self._out, self._out_reader.recheck)

    @property
    def is_tapped(self) -> bool:
        """Whether a client watches PDUs on the bus."""
        return self._taps > 0

    def publish(
        self,
        message: Delivered,
        age_s: float | None,
        received_ns: int,
        times: LocalTimes = UNKNOWN,
        retain: Retain = NOT_RETAINED,
    ) -> None:
        """Hand a message from the air to its consumers; `age_s` is None if unknown.

        `retain` says how many messages of its topic and source are kept for later consumers.
        """
        frame = self._frame_out(message.src, message.topic)
        header = header_of(message, age_s, received_ns, times)
        self._published += 1
        if retain.depth:
            kept = Retained(frame, header, message.payload, retain.lifespan_s, time.monotonic())
            self._retention.keep((message.src, message.series), kept, retain.depth)
        self._out.send_multipart(envelope.encode(frame, header, message.payload))
        self._out_reader.recheck()

    def forget_topics(self, changed: Iterable[tuple[int, int]]) -> None:
        """Forget what each (source, topic number) meant: its name, and the messages kept of it."""
        for key in changed:
            self._frames_out.pop(key, None)
            self._retention.forget(key)

    def publish_stop(self, src: int, topic: HeardTopic, payload: bytes) -> None:
        """Hand a topic's stop message to its consumers, as the topic has fallen silent."""
        self._retention.forget((src, topic.base))
        origin = topic.origin(src)
        header = envelope.OutHeader(s=origin, n=0, tr=time.time_ns(), ty=topic.type, stop=True)
        header.v = None if origin == src else src
        self._out.send_multipart(envelope.encode(self._frame_out(src, topic), header, payload))
        self._out_reader.recheck()

    def announce(self, policies: Mapping[int, TopicPolicy]) -> None:
        """Announce the topics, and the limits that `policies`, by topic id, now set for them."""
        self._welcome = self._announcement(policies)
        for topic in self._setup.registry.topics:
            if not policies.get(topic.id, DEFAULT_POLICY).latched:
                self._retention.forget_topic(topic.id)
        self._out.setsockopt(zmq.XPUB_WELCOME_MSG, b"\0" + self._welcome)
        self._undropped.send(b"", [b"\0" + self._welcome])

    def accept(self, name: str, topic: Topic) -> bool:
        """Accept messages of a declared topic under bus topic `name`, from the next announcement.

        Returns False if they were accepted before.
        """
        return self._intake.accept(name, topic)

    def names_in(self) -> Mapping[int, str]:
        """Names on the bus of the topics that are accepted, by topic id."""
        return self._intake.names

    def tell(self, verdict: Verdict) -> None:
        """Send a message's verdict to its producer."""
        name = self._intake.names[verdict.topic_id]
        self._tell(envelope.Receipt(verdict.receipt, name, *verdict[2:]))

    def _tell(self, told: envelope.Receipt) -> None:
        frame = envelope.VERSION_BYTE + msgspec.msgpack.encode(told)
        topic = RECEIPT_PREFIX + told.id.encode() + b"\0"
        # Our clients' ids are PRODUCER.NUMBER, so each producer gets a lane of its own.
        self._undropped.send(topic.rpartition(b".")[0], [topic, frame])

    def tap(self, direction: str, data: bytes) -> None:
        """Publish a PDU to the clients that watch PDUs; `direction` is rx or tx."""
        header = msgspec.msgpack.encode({"dir": direction, "t": time.time_ns()})
        self._out.send_multipart([PDU_TAP, envelope.VERSION_BYTE + header, data])
        self._out_reader.recheck()

    def tell_air(self, told: dict[str, object]) -> None:
        """Publish what is on the air to the clients that watch it (bus document, 4.5)."""
        self._out.send_multipart([AIR_TAP, envelope.VERSION_BYTE + msgspec.msgpack.encode(told)])
        self._out_reader.recheck()

    def _frame_out(self, src: int, topic: HeardTopic) -> bytes:
        frame = self._frames_out.get((src, topic.base))
        if frame is None:
            frame = self._setup.republished(src, topic.name).encode() + b"\0"
            self._frames_out[src, topic.base] = frame
        return frame

    def _announcement(self, policies: Mapping[int, TopicPolicy]) -> bytes:
        return announcement(self._setup, self._intake.topics, policies, self.boot)

    def names_out(self) -> dict[tuple[int, int], str]:
        """Names of the bus topics published so far, by (source, topic id)."""
        return {key: frame[:-1].decode() for key, frame in self._frames_out.items()}

    async def stop_ingress(self) -> None:
        """Take the messages that have arrived, then close the sockets of producers."""
        # Do not unbind first: libzmq would close the connections and lose what they still hold.
        deadline = time.monotonic() + LAST_MESSAGES_S
        quiet = 0
        while quiet < QUIET_ROUNDS and time.monotonic() < deadline:
            seen = self._received
            await asyncio.sleep(QUIET_S)
            quiet = quiet + 1 if seen == self._received else 0
        self._close_ingress()

    def _close_ingress(self) -> None:
        while self._ingress_readers:
            self._ingress_readers.pop().close()
        for socket in (self._pull, self._sub):
            socket.close()

    def close(self) -> None:
        """Close all sockets; consumers still get what ZeroMQ has queued for them."""
        self._close_ingress()
        self._undropped.close(1e-3 * LINGER_MS)
        self._out_reader.close()
        for socket in self._sockets.values():
            socket.close(linger=LINGER_MS)

    def report(self, control_requests: int) -> BusReport:
        """Counters of the bus, and what it last refused."""
        return BusReport(
            runtime_dir=str(self._directory.path),
            received=self._received,
            published=self._published,
            control_requests=control_requests,
            bad_envelope_last=self._intake.last_bad,
        )

    def listen(self, *, is_on: bool) -> None:
        """Accept new programs, or not; those that are connected stay. Raises BusError."""
        for name, each in self._sockets.items():
            (self._directory.bind_again if is_on else self._directory.unbind)(each, name)

    def _bind(self, kind: int, name: str, options: dict[int, int | bytes]) -> zmq.Socket[bytes]:
        bound = self._directory.bind(self._context, kind, name, options)
        self._sockets[name] = bound
        return bound

    def _take(self, frames: list[bytes]) -> None:
        if frames[0].startswith(SYNC_PREFIX):
            self._acknowledge(ACK_PREFIX + frames[0].removeprefix(SYNC_PREFIX))
            return
        self._received += 1
        self._intake.take(frames)
        if self._copied and len(frames) == 3 and (SENT_TAP + frames[0]).startswith(self._copied):
            self._out.send_multipart([SENT_TAP + frames[0], *frames[1:]])

    def _take_subscription(self, frames: list[bytes]) -> None:
        subscribed, topic = frames[0][:1] == b"\x01", frames[0][1:]
        if topic == PDU_TAP:
            # XPUB reports only the first watcher to subscribe and the last one to leave.
            self._taps = int(subscribed)
        elif topic == AIR_TAP:
            self.is_air_watched = subscribed
        elif topic.startswith(SENT_TAP):
            others = tuple(each for each in self._copied if each != topic)
            self._copied = (*others, topic) if subscribed else others
        elif subscribed and topic.startswith(ACK_PREFIX):
            # Subscriptions are processed in order, so the earlier ones are active now.
            self._acknowledge(topic)
        elif not topic or topic.startswith(b"/"):
            # XPUB reports the first client to subscribe and the last one to leave or to end.
            self.filters = self.filters | {topic} if subscribed else self.filters - {topic}
            if topic and subscribed:
                self.has_consumer.set()
        elif subscribed and topic.startswith(LATE_PREFIX):
            self._give_kept(topic)

    def _give_kept(self, request: bytes) -> None:
        """Give a consumer the kept messages that it requests, on its own topic `request`."""
        _, _, prefix = request.removeprefix(LATE_PREFIX).partition(b"\0")
        now = time.monotonic()
        for kept in self._retention.matching(prefix):
            if (header := kept.late(now)) is not None:
                frames = [request, *envelope.encode(kept.frame, header, kept.payload)]
                self._undropped.send(request, frames)
        self._undropped.send(request, [request])

    def _acknowledge(self, topic: bytes) -> None:
        self._undropped.send(topic, [topic, self._welcome])
