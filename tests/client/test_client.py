"""The client against a real daemon."""

import asyncio
import json
import os
import subprocess
import sys
import time

import pytest
import zmq

from sdrlinkd.client import (
    AsyncPublisher,
    AsyncSubscriber,
    NoDaemonError,
    Publisher,
    Subscriber,
)
from sdrlinkd.client.testing import topic_filter

CDR = b"\0\1\0\0"


def test_five_lines_each(daemon, monkeypatch):
    monkeypatch.setenv("SDRLINKD_RUNTIME_DIR", str(daemon.directory))
    with Subscriber("/rx_robot_1/odom") as heard:
        with Publisher() as out:
            out.send("/robot_1/odom", CDR + b"hello")
        for message in heard:
            assert message.payload == CDR + b"hello"
            break


async def test_five_lines_each_in_asyncio(daemon, monkeypatch):
    monkeypatch.setenv("SDRLINKD_RUNTIME_DIR", str(daemon.directory))
    async with AsyncSubscriber("/rx_robot_1/odom") as heard:
        async with AsyncPublisher() as out:
            await out.send("/robot_1/odom", CDR + b"hello")
        async for message in heard:
            assert message.payload == CDR + b"hello"
            break


async def test_receipts_in_asyncio(daemon):
    async with AsyncPublisher(daemon.directory) as out:
        assert await out.receipt(0) is None, "none was asked for"
        assert await out.send("/robot_1/odom", CDR) is None
        names = await asyncio.gather(
            *(out.send("/robot_1/odom", CDR + bytes(4), dst=1, receipt=True) for _ in range(5))
        )
        told = [await out.receipt(20) for _ in names]
        assert {each.id for each in told} == set(names)
        assert {(each.topic, each.dst, each.fate, each.left) for each in told} == {
            ("/robot_1/odom", 1, "delivered", 0)
        }
        assert await out.receipt(0.05) is None
        await out.send("/robot_1/odom", CDR, dst=1, receipt=True)


def test_a_prefix_takes_all_and_a_name_only_itself(start_daemon):
    registry_topics = "imu,sensor_msgs/Imu\nimu2,sensor_msgs/Imu\n"
    directory = start_daemon().directory
    own = directory / "own.csv"
    own.write_text(registry_topics)
    daemon = start_daemon(f'registry = "{own}"\n')
    with (
        Subscriber("/rx_robot_1/imu", directory=daemon.directory) as one,
        Subscriber("/rx_robot_1/*", directory=daemon.directory) as both,
        Subscriber("*", directory=daemon.directory) as all_of_it,
        Publisher(daemon.directory) as out,
    ):
        out.send("/robot_1/imu2", CDR + b"2")
        out.send("/robot_1/imu", CDR + b"1")
        assert [both.receive(5).payload[-1:] for _ in range(2)] == [b"2", b"1"]
        assert [all_of_it.receive(5).payload[-1:] for _ in range(2)] == [b"2", b"1"]
        assert one.receive(5).payload[-1:] == b"1"
        assert one.receive(0) is None


def test_everything_is_every_topic_and_nothing_else():
    """A daemon that waits for its first consumer only notices filters of topics."""
    assert topic_filter("*") == topic_filter("/*") == b"/"


def test_a_burst_and_an_immediate_exit_arrive_whole(start_daemon):
    daemon = start_daemon()
    code = (
        "from sdrlinkd.client import Publisher\n"
        "with Publisher() as out:\n"
        "    for i in range(5000): out.send('/robot_1/odom', bytes([0, 1, 0, 0]) + bytes(700))\n"
    )
    environment = {**os.environ, "SDRLINKD_RUNTIME_DIR": str(daemon.directory)}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment, timeout=60)
    assert daemon.snapshot().link.tx.accepted == 5000


def test_flush_ends_when_all_is_taken(start_daemon):
    daemon = start_daemon()
    code = (
        "import os\n"
        "from sdrlinkd.client import Publisher\n"
        "out = Publisher()\n"
        "for i in range(3000): out.send('/robot_1/odom', bytes([0, 1, 0, 0]) + bytes(700))\n"
        "out.flush()\n"
        "os._exit(0)\n"
    )
    environment = {**os.environ, "SDRLINKD_RUNTIME_DIR": str(daemon.directory)}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment, timeout=60)
    snapshot = daemon.snapshot()
    assert (snapshot.link.tx.accepted, snapshot.bus.received) == (3000, 3000)


def test_numbers_run_per_topic_and_nothing_is_lost(start_daemon):
    daemon = start_daemon()
    before_ns = time.time_ns()
    with (
        Subscriber("/rx_robot_1/*", directory=daemon.directory) as heard,
        Publisher(daemon.directory) as out,
    ):
        for i in range(20):
            out.send("/robot_1/odom", CDR + bytes([i]))
            out.send("/robot_1/imu", CDR + bytes([i]), type="sensor_msgs/msg/Imu")
        messages = [heard.receive(5) for _ in range(40)]
        assert heard.receive(0) is None
    for name, kind in (("odom", "nav_msgs/msg/Odometry"), ("imu", "sensor_msgs/msg/Imu")):
        mine = [m for m in messages if m.topic == f"/rx_robot_1/{name}"]
        assert [m.payload for m in mine] == [CDR + bytes([i]) for i in range(20)]
        assert [m.number - mine[0].number for m in mine] == list(range(20))
        assert {(m.source, m.type, m.lost_pdus) for m in mine} == {(1, kind, 0)}
        assert all(before_ns <= m.received_ns <= time.time_ns() for m in mine)


def test_a_slow_reader_sees_the_gap_in_the_numbers(start_daemon):
    daemon = start_daemon()
    sent = 3000
    with (
        Subscriber("/rx_robot_1/odom", directory=daemon.directory, depth=1) as slow,
        Subscriber("/rx_robot_1/odom", directory=daemon.directory, depth=0) as quick,
        Publisher(daemon.directory) as out,
    ):
        for i in range(sent):
            out.send("/robot_1/odom", CDR + i.to_bytes(4, "little") + bytes(700))
            if i % 20 == 19:
                for _ in range(20):
                    last = quick.receive(5)
        kept = []
        while (message := slow.receive(0.2)) is not None:
            kept.append(message)
    first = kept[0].number - int.from_bytes(kept[0].payload[4:8], "little")
    assert last.number - first == sent - 1
    assert len(kept) < sent
    for message in kept:
        assert message.number - first == int.from_bytes(message.payload[4:8], "little")


@pytest.mark.parametrize(
    "make",
    [lambda d: Publisher(d, timeout_s=0.2), lambda d: Subscriber(directory=d, timeout_s=0.2)],
)
def test_without_a_daemon_it_says_where_it_looked(tmp_path, make):
    started_at = time.monotonic()
    with pytest.raises(NoDaemonError, match=str(tmp_path)), make(tmp_path) as socket:
        socket.send("/a", CDR)
    assert 0.15 < time.monotonic() - started_at < 3


async def test_without_a_daemon_in_asyncio(tmp_path):
    with pytest.raises(NoDaemonError, match=str(tmp_path)):
        async with asyncio.timeout(10), AsyncPublisher(tmp_path, timeout_s=0.2) as out:
            await out.send("/a", CDR)
    with pytest.raises(NoDaemonError, match=str(tmp_path)):
        async with asyncio.timeout(10), AsyncPublisher(tmp_path, timeout_s=0.2) as out:
            await out.send("/a", CDR, receipt=True)
    with pytest.raises(NoDaemonError, match=str(tmp_path)):
        async with asyncio.timeout(10), AsyncSubscriber(directory=tmp_path, timeout_s=0.2):
            pass


@pytest.mark.parametrize("header", [json.dumps({"q": "urgent", "p": 3}).encode(), b"\x01\x80"])
def test_a_program_that_publishes_with_pub(daemon, header):
    context = zmq.Context()
    with context.socket(zmq.PUB) as pub, Subscriber(directory=daemon.directory) as heard:
        pub.connect(f"ipc://{daemon.directory}/in-pub.sock")
        message = None
        while message is None:
            pub.send_multipart([b"/robot_1/odom\0", header, CDR + b"pub"])
            message = heard.receive(0.05)
        assert message.payload == CDR + b"pub"
    context.term()


def test_the_welcome_tells_who_answers(daemon):
    context = zmq.Context()
    with context.socket(zmq.SUB) as sub:
        sub.subscribe(b"\0")
        sub.connect(f"ipc://{daemon.directory}/out.sock")
        assert sub.poll(5000)
        (frame,) = sub.recv_multipart()
        assert frame.startswith(b"\0\x01")
        assert b"sdrlinkd" in frame
        assert b"/robot_1/odom" in frame
    context.term()
