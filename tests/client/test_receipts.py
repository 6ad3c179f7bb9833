"""Every message that requests a receipt is answered, whatever becomes of it and of its daemon."""

import asyncio
import json
import time
from collections import Counter

import msgspec
import pytest
import zmq

from sdrlinkd.client import (
    DAEMON_GONE,
    ENVELOPE_VERSION,
    AsyncPublisher,
    Publisher,
    pack_map,
)
from sdrlinkd.client.testing import CONSTANTS, new_ack_topic
from tests.conftest import ETC
from tests.programs import Daemon
from tests.waiting import wait_for

CDR = b"\0\1\0\0"
ODOM = "/robot_1/odom"


@pytest.mark.parametrize(
    ("frames", "told"),
    [
        (["/robot_1/no", {"id": "x"}, CDR], ("/robot_1/no", 255, "tx_unknown_topic")),
        (["/robot_1/no", {"id": "x", "d": 7}, CDR], ("/robot_1/no", 7, "tx_unknown_topic")),
        ([ODOM, {"id": "x", "q": "fast", "d": 3}, CDR], (ODOM, 3, "tx_bad_envelope")),
        ([ODOM, {"id": "x", "p": 128}, CDR], (ODOM, 255, "tx_bad_envelope")),
        ([ODOM, {"id": "x", "d": 256}, CDR], (ODOM, 255, "tx_bad_envelope")),
        ([ODOM, {"id": "x", "ls": 0}, CDR], (ODOM, 255, "tx_bad_envelope")),
        ([ODOM, {"id": "x", "more": "x" * 300}, CDR], (ODOM, 255, "tx_bad_envelope")),
        ([ODOM, {"id": "x"}], (ODOM, 255, "tx_bad_envelope")),
        ([ODOM, {"id": "x"}, b"abc"], (ODOM, 255, "tx_bad_envelope")),
        ([ODOM, {"id": "x", "ty": "a/msg/B"}, CDR], (ODOM, 255, "tx_bad_envelope")),
        ([ODOM, {"id": "x", "d": 4}, CDR + bytes(300_000)], (ODOM, 4, "tx_too_big")),
        ([ODOM, {"id": "x"}, CDR + bytes(1 << 20)], (ODOM, 255, "tx_too_big")),
        (["/robot_1/imu", {"id": "x"}, CDR + bytes(9)], ("/robot_1/imu", 255, "tx_size_cap")),
        (["/robot_1/map", {"id": "x"}, CDR], ("/robot_1/map", 255, "tx_throttled")),
        (["/robot_1/clock", {"id": "x"}, CDR], ("/robot_1/clock", 255, "tx_unchanged")),
    ],
)  # fmt: skip
@pytest.mark.parametrize("form", ["MessagePack", "JSON"])
def test_what_is_refused_is_answered_too(policed, frames, told, form):
    topic, header, *payload = frames
    packed = json.dumps(header).encode()
    if form == "MessagePack":
        packed = ENVELOPE_VERSION + pack_map(header)
    assert policed([topic.encode() + b"\0", packed, *payload]) == {
        "id": "x", "topic": told[0], "d": told[1], "fate": "dropped", "reason": told[2],
    }  # fmt: skip


@pytest.fixture(scope="module")
def module_daemon(tmp_path_factory):
    directory = tmp_path_factory.mktemp("policed")
    config = directory / "sdrlinkd.toml"
    config.write_text(
        f'registry = "{ETC / "registry.csv"}"\n[bus]\nruntime_dir = "{directory}"\n'
        "[topic.imu]\nmax_bytes = 8\n[topic.map]\nperiod_s = 1000\n"
        "[topic.clock]\non_change = true\n"
    )
    daemon = Daemon(directory, config, directory / "log").at_work()
    with Publisher(directory) as out:
        out.send("/robot_1/map", CDR)
        out.send("/robot_1/clock", CDR)
    yield daemon
    daemon.ends_well()


@pytest.fixture
def policed(module_daemon):
    """Sends raw frames; returns the receipt."""
    context = zmq.Context()
    with context.socket(zmq.SUB) as sub, context.socket(zmq.PUSH) as push:
        sub.connect(f"ipc://{module_daemon.directory}/out.sock")
        push.connect(f"ipc://{module_daemon.directory}/in.sock")
        sub.subscribe(b"\0receipt\0")
        # A new topic each time, because only the first of several subscribers is answered.
        here = new_ack_topic()
        sub.subscribe(here)
        assert sub.poll(20_000), "the daemon does not answer"
        assert sub.recv_multipart()[0] == here

        def send(frames):
            push.send_multipart(frames)
            assert sub.poll(20_000), "no receipt came"
            topic, told = sub.recv_multipart()
            assert topic == b"\0receipt\0x\0"
            return msgspec.msgpack.decode(told[1:])

        yield send
    context.term()


def test_a_client_that_does_not_check_is_answered(start_daemon):
    daemon = start_daemon()
    with Publisher(daemon.directory, checked=False) as out:
        name = out.send("/robot_1/nothing", CDR, dst=9, receipt=True)
        told = out.receipt()
        assert (told.id, told.dst, told.fate, told.reason) == (
            name,
            9,
            "dropped",
            "tx_unknown_topic",
        )
        assert out.receipt() is None, "nothing is owed any more"


@pytest.mark.parametrize("rx_depth", [1, 256])
def test_many_answers_at_once_all_come(start_daemon, rx_depth):
    """A lone robot gives up on all of them in one tick of its timers."""
    daemon = start_daemon(
        f"rx_depth = {rx_depth}\n[link]\nreceipt_s = 0.3\n[direct]\nhear_self = false\n"
    )
    with Publisher(daemon.directory) as out:
        names = [out.send(ODOM, CDR, receipt=True) for _ in range(1500)]
        told = [out.receipt() for _ in names]
        assert sorted(each.id for each in told) == sorted(names)
        assert Counter(each.fate for each in told) == {"unknown": 1500}
        assert out.receipt() is None


def test_a_producer_that_does_not_read_holds_up_nobody_else(start_daemon):
    daemon = start_daemon("rx_depth = 9\n[link]\nreceipt_s = 0.1\n[direct]\nhear_self = false\n")
    context = zmq.Context()
    with (
        context.socket(zmq.SUB) as frozen,
        context.socket(zmq.PUSH) as push,
        Publisher(daemon.directory) as out,
    ):
        frozen.rcvhwm = 1
        frozen.subscribe(b"\0receipt\0frozen")
        frozen.subscribe(b"\0ack\0frozen\0")
        frozen.connect(f"ipc://{daemon.directory}/out.sock")
        assert frozen.poll(20_000)
        push.connect(f"ipc://{daemon.directory}/in.sock")
        # More than the operating system buffers for a socket, too.
        header = ENVELOPE_VERSION + pack_map({"id": "frozen." + "x" * 200, "d": 7})
        for _ in range(6000):
            push.send_multipart([b"/robot_1/nothing\0", header, CDR])
        names = [out.send(ODOM, CDR, receipt=True) for _ in range(300)]
        told = [out.receipt() for _ in names]
        assert sorted(each.id for each in told) == sorted(names)
        assert DAEMON_GONE not in {each.reason for each in told}
    context.term()


def test_a_daemon_that_is_restarted_owes_nothing(start_daemon, spawn_again):
    daemon = start_daemon("[link]\nreceipt_s = 60\n[direct]\nhear_self = false\n")
    with Publisher(daemon.directory) as out:
        names = [out.send(ODOM, CDR, dst=2, receipt=True) for _ in range(3)]
        daemon.kill()
        daemon.expected_exit = -9
        wait_for(spawn_again(daemon).is_up)
        later = out.send("/robot_1/scan", CDR, dst=3, lifespan_ms=1e-3, receipt=True)
        # Messages of the new daemon may come in between.
        told = [out.receipt(30) for _ in (*names, later)]
        assert sorted((each.id, each.dst, each.fate, each.reason) for each in told) == [
            *((name, 2, "unknown", DAEMON_GONE) for name in names),
            (later, 3, "expired", "tx_expired"),
        ]


@pytest.fixture
def impatient(monkeypatch):
    """A producer that assumes sooner that a daemon is gone."""
    monkeypatch.setattr(*CONSTANTS["still_there_s"], 0.1)
    monkeypatch.setattr(*CONSTANTS["gone_s"], 0.5)


def test_a_daemon_that_never_comes_back_owes_nothing(start_daemon, impatient):
    daemon = start_daemon("[link]\nreceipt_s = 60\n[direct]\nhear_self = false\n")
    out = Publisher(daemon.directory)
    name = out.send(ODOM, CDR, dst=2, receipt=True)
    daemon.kill()
    daemon.expected_exit = -9
    # Applies also to a caller that never waits for long.
    deadline = time.monotonic() + 60
    while (told := out.receipt(0.05)) is None:
        assert time.monotonic() < deadline
    assert (told.id, told.fate, told.reason) == (name, "unknown", DAEMON_GONE)
    assert out.receipt() is None
    out.close()


async def test_a_daemon_that_is_gone_owes_nothing_in_asyncio(start_daemon, impatient):
    daemon = start_daemon("[link]\nreceipt_s = 60\n[direct]\nhear_self = false\n")
    out = AsyncPublisher(daemon.directory)
    name = await out.send(ODOM, CDR, dst=2, receipt=True)
    daemon.kill()
    daemon.expected_exit = -9
    told = await asyncio.wait_for(out.receipt(), 60)
    assert (told.id, told.fate, told.reason) == (name, "unknown", DAEMON_GONE)
    assert await out.receipt() is None
    await out.close()


async def test_tasks_share_a_publisher(start_daemon):
    """One waits for receipts, others send, query and flush: no task takes another's answer."""
    daemon = start_daemon()
    async with AsyncPublisher(daemon.directory) as out:
        names, told = [], []

        async def hear():
            # Without receipts pending, `receipt` returns at once, and lets other tasks run.
            while len(told) < 200:
                if (each := await out.receipt(0.02)) is not None:
                    told.append(each.id)

        async def say(robot):
            for _ in range(50):
                names.append(await out.send(ODOM, CDR, dst=robot, receipt=True))
                await out.flush()

        await asyncio.wait_for(asyncio.gather(hear(), *(say(1) for _ in range(4))), 90)
        assert sorted(told) == sorted(names)
