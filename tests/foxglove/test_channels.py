"""What the air may do to the bridge, and a client that reads too slowly; without daemons."""

import asyncio
import contextlib
import json
import resource
import socket
import struct
import time
from contextlib import closing

import numpy as np
import pytest
from foxglove import Context
from foxglove.websocket import ServerListener
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.client import Message
from sdrlinkd.errors import UserError
from sdrlinkd.foxglove import Command, Rules
from sdrlinkd.foxglove.testing import (
    CHANNEL,
    CONSTANTS,
    Door,
    Operators,
    ReceivedTopics,
    Scene,
    SlowClients,
    cdr_of,
    start_server,
)
from tests.cli.snapshots import SNAPSHOT
from tests.foxglove.viewer import SUBPROTOCOL, Viewer
from tests.laws import law

CDR = b"\0\1\0\0"
SECRET = "/secret"
HOSTILE = (
    ("/x\0\n\"}],{", "a/msg/B"),
    ("/rx_robot_1/\u202eevil<script>", "'; drop"),
    ("", ""),
    ("/" + "y" * 10_000, "z" * 10_000),
    ("/rx_robot_1/odom", "nav_msgs/msg/Odometry"),
)  # fmt: skip


def message(topic="/rx_robot_1/odom", kind="nav_msgs/msg/Odometry", payload=CDR, time_ns=1):
    return Message(
        topic=topic, payload=payload, type=kind, source=1, number=1, lost_pdus=0, age_us=None,
        received_ns=time_ns, hops_left=0, snr_db=None,
    )  # fmt: skip


class Subscriptions(ServerListener):
    """The topics that clients have subscribed to."""

    def __init__(self):
        self.topics = []

    def on_subscribe(self, client, channel):
        self.topics.append(channel.topic)


@pytest.fixture
def context():
    return Context()


@pytest.fixture
def subscriptions():
    return Subscriptions()


@pytest.fixture
def url(context, subscriptions):
    """The address of a server."""
    started = start_server(context, subscriptions)
    yield f"ws://127.0.0.1:{started.port}"
    started.stop()


def test_names_and_types_from_the_air_are_only_text(context, url, subscriptions):
    topics = ReceivedTopics(context)
    with Viewer(url, "*") as viewer:
        for topic, kind in HOSTILE:
            topics.take(message(topic, kind))
        viewer.until(lambda: {topic for topic, _ in HOSTILE} <= set(subscriptions.topics))
        for topic, kind in HOSTILE:
            assert viewer.channels[topic]["schemaName"] == kind
        for topic, kind in HOSTILE:
            topics.take(message(topic, kind, CDR + b"again"))
        viewer.until(lambda: all(viewer.payloads(topic) for topic, _ in HOSTILE))
        assert {viewer.payloads(topic)[-1] for topic, _ in HOSTILE} == {CDR + b"again"}
        # A topic that has got another type is another channel.
        topics.take(message(kind="sensor_msgs/msg/Imu"))
        odom = "/rx_robot_1/odom"
        viewer.until(lambda: viewer.channels[odom]["schemaName"] == "sensor_msgs/msg/Imu")
    assert len(topics) == len(HOSTILE)
    assert topics.passed == 2 * len(HOSTILE) + 1


def test_endless_new_names_fill_nothing(context, monkeypatch, caplog):
    monkeypatch.setattr(*CONSTANTS["most_channels"], 5)
    topics = ReceivedTopics(context)
    for number in range(20):
        topics.take(message(f"/rx_robot_1/{number}"))
    topics.take(message("/rx_robot_1/3"))
    assert (len(topics), topics.passed, topics.not_shown) == (5, 6, 15)
    assert [each.message for each in caplog.records] == [
        "more than 5 topics; the others are not shown"
    ]


def test_last_messages_are_kept_within_bounds(context, monkeypatch):
    given = {}

    class Channel:
        def __init__(self, topic, **_):
            self.topic = topic

        def log(self, payload, *, log_time, sink_id=None):
            if sink_id is not None:
                given[self.topic] = len(payload)

        def close(self):
            pass

    monkeypatch.setattr(*CONSTANTS["channel"], Channel)
    monkeypatch.setattr(*CONSTANTS["most_kept_bytes"], 1000)
    topics = ReceivedTopics(context)
    for size in (600, 300, 500, 1001, 200):
        topics.take(message("/a", payload=bytes(size)))
    topics.take(message("/b", payload=bytes(900)))
    topics.take(message("/a", kind="a/msg/B", payload=bytes(100)))
    topics.take(message("/b", payload=bytes(900)))
    topics.take(message("/c", payload=bytes(1)))
    now = time.monotonic()
    for topic in ("/a", "/b", "/c"):
        # Who had subscribed before has got it.
        topics.again(topic, 1, now - 60.0)
    assert given == {}
    for topic in ("/a", "/b", "/c"):
        topics.again(topic, 1, now)
    assert given == {"/a": 100, "/b": 900}


def test_messages_that_are_not_of_their_type_draw_nothing(context):
    scene = Scene(context)
    for payload in (b"", CDR, CDR + b"\xff" * 700, bytes(10_000)):
        scene.take(message(payload=payload))
    assert scene.unreadable >= 3


@pytest.mark.slow
def test_a_slow_client_loses_the_oldest_and_holds_nobody_up(context, url, subscriptions):
    topics, n = ReceivedTopics(context), 20_000
    topics.take(message())
    with (
        closing(SlowClients()) as slow,
        Viewer(url, "*") as quick,
        socket.create_connection(_address(url)) as stuck,
    ):
        _subscribe(stuck, url)
        quick.until(lambda: len(subscriptions.topics) == 2)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        for number in range(n):
            topics.take(message(payload=number.to_bytes(4, "little") + bytes(10_000)))
        grown_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
        # 200 MB were sent; what waits is bounded, twice: for each of the two clients.
        assert grown_kib < 60_000
        quick.until(lambda: _numbers(quick)[-1:] == [n - 1])
        assert slow.count >= 1
        stuck.settimeout(2)
        left = b""
        while (n - 1).to_bytes(4, "little") + bytes(100) not in left[-20_000:]:
            left += stuck.recv(1 << 20)
        assert len(left) < 20_000 * 1000
    assert _numbers(quick) == sorted(_numbers(quick))


def _numbers(viewer):
    return [int.from_bytes(each[:4], "little") for each in viewer.payloads("/rx_robot_1/odom")]


def _address(url):
    host, _, port = url.removeprefix("ws://").partition(":")
    return host, int(port)


def _subscribe(stuck, url):
    """Open a WebSocket by hand, subscribe to the first channel, and read nothing more."""
    stuck.sendall(
        f"GET / HTTP/1.1\r\nHost: {url}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
        f"Sec-WebSocket-Protocol: {SUBPROTOCOL}\r\n\r\n".encode()
    )
    greeting = b""
    while b'"advertise"' not in greeting:
        greeting += stuck.recv(1 << 16)
    channel = int(greeting.split(b'{"id":')[1].split(b",")[0])
    asked = {"op": "subscribe", "subscriptions": [{"id": 1, "channelId": channel}]}
    text = json.dumps(asked).encode()
    # A text frame with a mask of zeros.
    stuck.sendall(struct.pack("!BB4x", 0x81, 0x80 | len(text)) + text)


async def test_of_a_flood_of_commands_the_newest_counts():
    said, sent, patterns = [], [], ["/robot_2/*"]

    async def publish(_, name, cdr, *__, **___):
        sent.append((name, cdr))

    taker = Operators(patterns, SECRET, lambda *each: said.append(each), publish, print)
    client = type("Client", (), {"id": 1})
    door = {"id": CHANNEL, "topic": SECRET, "schema_name": "", "encoding": "json"}
    taker.on_client_advertise(client, type("Channel", (), door))
    for number, topic in enumerate(("/robot_2/cmd_vel", "/robot_2/led", "/robot_3/cmd_vel")):
        shape = {"id": number, "topic": topic, "schema_name": "a/B", "encoding": "cdr"}
        taker.on_client_advertise(client, type("Channel", (), shape))
    for number in range(100):
        taker.on_message_data(client, 0, CDR + bytes([number]))
    taker.on_message_data(client, 1, CDR)
    taker.on_message_data(client, 2, CDR)
    taker.on_client_unadvertise(client, 1)
    taker.on_message_data(client, 1, CDR)
    taker.snapshot = SNAPSHOT
    sending = asyncio.ensure_future(taker.send_all(None))
    async with asyncio.timeout(10):
        while taker.sent < 2:  # noqa: ASYNC110  # it is the loop that sends
            await asyncio.sleep(0)
    sending.cancel()
    assert sent == [("/robot_2/cmd_vel", CDR + b"\x63"), ("/robot_2/led", CDR)]
    assert (taker.outdated, taker.refused, len(said)) == (99, 2, 1)


async def test_an_address_that_is_taken_or_wrong_is_one_sentence(url):
    port = _address(url)[1]
    with pytest.raises(UserError, match=f"--listen 127.0.0.1:{port}: .*address already in use"):
        await Door(Rules(is_local=True), port).open("127.0.0.1", port)


@law(200)
@given(
    st.binary(max_size=300)
    | st.recursive(
        st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
        lambda each: st.lists(each, max_size=3) | st.dictionaries(st.text(max_size=8), each),
    ).map(lambda each: json.dumps({"linear": each}).encode())
    | st.sampled_from([b"[" * 200_000, b'{"a":' * 60_000, b'{"linear": {"x": 1e999}}'])
)
def test_any_command_is_a_message_or_refused_in_a_sentence(data):
    for encoding in ("cdr", "json"):
        command = Command(2, "/cmd_vel", "geometry_msgs/msg/Twist", encoding)
        with contextlib.suppress(UserError):
            assert np.isfinite(np.frombuffer(cdr_of(command, data)[4:52], "<f8")).all()


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999", "-1e999"])
def test_numbers_that_are_not_finite_are_refused(number):
    command = Command(2, "/cmd_vel", "geometry_msgs/msg/Twist", "json")
    with pytest.raises(UserError, match="allowed: finite numbers"):
        cdr_of(command, f'{{"linear": {{"x": {number}}}}}'.encode())
    twist = CDR + struct.pack("<6d", *5 * [0.0], float(number))
    with pytest.raises(UserError, match="allowed: finite numbers"):
        cdr_of(command._replace(encoding="cdr"), twist)
